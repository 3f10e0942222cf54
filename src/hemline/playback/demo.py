"""The whole loop on what ships with the package: once with the shipped model, once from nothing."""

import json
from collections.abc import Callable
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from hemline import animators, bodies, datasets, export, garments, motions, sim
from hemline.errors import MissingExtra
from hemline.files import written_whole

from .evaluate import Evaluation, evaluate
from .frame import Frame
from .record import record

Say = Callable[[str], None]
"""Called with one line for the user."""

SMALL_EPOCHS = 60
"""Passes over the data in the demo from nothing."""

RUN_IN = 1.0
"""What is shown begins this long after the start [s]: the run is a loop, and the cape settled in a runner's pose."""


def demo(folder: Path, *, say: Say) -> dict[str, Any]:
    """Play the shipped cape on the shipped run: `cape.glb`, `cape.webp`, `report.json`.

    Args:
        folder: Where to write; made when missing.
        say: Told what happens.

    Returns:
        The figures, as in `report.json`.
    """
    folder.mkdir(parents=True, exist_ok=True)
    say("playing the shipped cape on the shipped run")
    return _played(folder, "cape", animators.load("cape"), motions.load("run"), say)


def demo_from_nothing(folder: Path, *, say: Say, jobs: int = 2) -> dict[str, Any]:
    """Simulate, fit, animate and evaluate the light cape on the shipped excerpts: two to ten minutes on two cores.

    Args:
        folder: Where to write the dataset, the model and the files of `demo`; what is there already is kept.
        say: Told what happens.
        jobs: Processes of the simulation.

    Returns:
        The figures of the model on an excerpt that it was not fitted on, with the simulation as truth.
    """
    if find_spec("torch") is None:
        raise MissingExtra("torch", "learn", "fitting a model")
    folder.mkdir(parents=True, exist_ok=True)
    garment = garments.load("cape-light")
    clips = [sim.Clip(motions.load(name), motions.subject_of(name)) for name in motions.names()]
    say(f"1/4 simulate: {len(clips)} excerpts, {len(garment.vertices)} vertices")
    counted: dict[str, int] = {}

    def report(clip: str, done: int, total: int) -> None:
        if done == total and counted.get(clip) != total:
            say(f"    {clip}: {total} frames")
        counted[clip] = done

    rows = sim.produce(folder / "cape-light", garment, clips, jobs=jobs, report=report)
    say(f"2/4 fit: {sum(row.clip_frames for row in rows)} frames")
    dataset = datasets.open_dataset(folder / "cape-light")
    config = replace(animators.animator_kind("ropes").Config(), epochs=SMALL_EPOCHS)
    animator = animators.fit(dataset, "ropes", config, seed=0)
    animator.save(folder / "cape-light.safetensors")
    held_out = motions.load(dataset.split("test")[0].clip)
    say(f"3/4 animate, 4/4 evaluate on {held_out.name}, which the fit did not see")
    return _played(folder, "cape", animator, held_out, say, truth=dataset)


def _played(
    folder: Path, name: str, animator: Any, motion: motions.Motion, say: Say, *, truth: datasets.Dataset | None = None
) -> dict[str, Any]:
    body = bodies.load(animator.body_name).shaped()
    frames: list[Frame] = []
    evaluation: Evaluation = evaluate(animator, body, motion, truth=truth, keep=frames.append)
    fps = evaluation.figures["fps"]
    # the figures are of all frames; what is shown begins when the cloth has left the first pose behind
    shown = frames[round(RUN_IN * fps) :] or frames
    clip = record(
        shown, garment_name=animator.garment.name, garment_faces=animator.garment.faces, motion=motion, fps=fps
    )
    for ending in ("glb", "webp"):
        for path in export.write(folder / f"{name}.{ending}", clip):
            say(str(path))
    with written_whole(folder / "report.json") as temporary:
        temporary.write_text(json.dumps(evaluation.figures, indent=1))
    say(str(folder / "report.json"))
    return evaluation.figures


__all__ = ["demo", "demo_from_nothing"]
