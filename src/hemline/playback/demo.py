"""Two demonstrations on the data of the package: with the shipped models, and from simulation to a new model."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from hemline import animators, bodies, datasets, export, garments, motions, sim
from hemline.animators.own_body import own_body
from hemline.export.clip import ClipPart
from hemline.export.images import render_frames
from hemline.files import atomic_write
from hemline.pictures import write_webp
from hemline.playback.player.frame import Frame

from .evaluate import Evaluation, evaluate
from .record import record

Say = Callable[[str], None]
"""Function that is called with each line for the user."""

DEMO_STEPS = 12
"""Number of lines that `demo` says."""

RUN_IN = 1.0
"""Time that is cut from the start [s]: the run is a loop, and the cape settles in a pose of it."""


SHAPES = {"mean": (), "tall": (1.5, -1.0), "small": (-1.0, 1.0)}
"""Betas of the bodies on which the T-shirt is shown."""

SHIRT_SECONDS = 2.0
"""Length of the dance for the T-shirt [s]."""

SPACING = 1.2
"""Distance between the bodies in the picture [m]."""

DRESS, DRESS_SECONDS = "dress-light", 2.0
"""Garment that is played without a fit, and for how long [s]."""

PICTURE_SIZE = (960, 480)
"""Width and height of the picture [pixels]."""


def demo(folder: Path, *, say: Say) -> dict[str, Any]:
    """Plays the shipped cape on a run, the shipped T-shirt on bodies of three shapes, and a dress without a fit.

    Writes `cape.glb`, `cape.webp`, a `tshirt-SHAPE.glb` for each shape, `tshirt.webp`, `dress.glb`, `dress.webp` and
    `report.json`.

    Args:
        folder: The folder to write to; it is made if missing.
        say: Called with each line for the user.

    Returns:
        The figures of each garment and shape, as in `report.json`.
    """
    folder.mkdir(parents=True, exist_ok=True)
    say("playing the shipped cape on the shipped run")
    cape = animators.load("cape")
    figures = {"cape": _play_cape(folder, cape, motions.load("run"), say)}
    say(f"playing the shipped T-shirt on a dance, on {len(SHAPES)} bodies")
    figures |= _on_three_bodies(folder, say)
    say("playing a dress that no model was fitted to")
    return _report(folder, figures | {"dress": _play_dress(folder, say)}, say)


def demo_from_nothing(folder: Path, *, say: Say, jobs: int = 2) -> dict[str, Any]:
    """Simulates, fits, animates and evaluates the light cape, which takes two to ten minutes on two cores.

    Args:
        folder: The folder for the dataset, the model and the files of `demo`; existing takes are reused.
        say: Called with each line for the user.
        jobs: Number of processes of the simulation.

    Returns:
        The figures of the model, named `cape`, on a motion outside the fit, compared with its simulation.
    """
    folder.mkdir(parents=True, exist_ok=True)
    garment = garments.load("cape-light")
    clips = [sim.ClipRequest(motions.load(name), motions.subject_of(name)) for name in motions.names()]
    say(f"1/4 simulate: {len(clips)} excerpts, {len(garment.vertices)} vertices")
    counted: dict[str, int] = {}

    def report(clip: str, done: int, total: int) -> None:
        if done == total and counted.get(clip) != total:
            say(f"    {clip}: {total} frames")
        counted[clip] = done

    rows = sim.produce(folder / "cape-light", garment, clips, jobs=jobs, report=report)
    say(f"2/4 fit: {sum(row.clip_frames for row in rows)} frames")
    dataset = datasets.open_dataset(folder / "cape-light")
    animator = animators.fit(dataset, "ropes", seed=0)
    animator.save(folder / "cape-light.safetensors")
    held_out = motions.load(dataset.split("test")[0].clip)
    say(f"3/4 animate, 4/4 evaluate on {held_out.name}, which the fit did not see")
    return _report(folder, {"cape": _play_cape(folder, animator, held_out, say, truth=dataset)}, say)


def _play_cape(
    folder: Path, animator: Any, motion: motions.Motion, say: Say, *, truth: datasets.Dataset | None = None
) -> dict[str, Any]:
    """Writes `cape.glb` and `cape.webp` on the mean body; returns the figures."""
    figures, clip = _evaluate_and_record(animator, own_body(animator).shaped(), motion, truth=truth, run_in=RUN_IN)
    for ending in ("glb", "webp"):
        _write(folder / f"cape.{ending}", clip, say)
    return figures


def _play_dress(folder: Path, say: Say) -> dict[str, Any]:
    """Writes `dress.glb` and `dress.webp` of a garment that `live` simulates; returns the figures."""
    body, turn = bodies.load("anny24").shaped(), motions.load("turn")
    live = animators.load("live")
    assert isinstance(live, animators.Wearable)
    dress = live.animator_for(garments.load(DRESS), body)
    figures, clip = _evaluate_and_record(dress, body, turn[: round(DRESS_SECONDS * turn.fps)])
    for ending in ("glb", "webp"):
        _write(folder / f"dress.{ending}", clip, say)
    return figures


def _on_three_bodies(folder: Path, say: Say) -> dict[str, Any]:
    """Writes a file for each shape and one picture of all; returns the figures by name."""
    shirt, dance = animators.load("tshirt-light"), motions.load("dance")
    body, figures, clips = own_body(shirt), {}, []
    motion = dance[: round(SHIRT_SECONDS * dance.fps)]
    for name, betas in SHAPES.items():
        figures[f"tshirt {name}"], clip = _evaluate_and_record(shirt, body.shaped(betas), motion)
        _write(folder / f"tshirt-{name}.glb", clip, say)
        clips.append(clip)
    scene = _side_by_side(clips)
    pictures = list(render_frames(scene, view="front", size=PICTURE_SIZE, frames=range(scene.frame_count)))
    write_webp(folder / "tshirt.webp", pictures, scene.fps)
    say(str(folder / "tshirt.webp"))
    return figures


def _side_by_side(clips: list[export.Clip]) -> export.Clip:
    """Returns one scene of all clips, which shows their sizes beside each other."""
    away = [np.array([SPACING * number, 0.0, 0.0], np.float32) for number in range(len(clips))]

    def join(parts: list[ClipPart]) -> tuple[np.ndarray, np.ndarray]:
        starts = np.cumsum([0, *(part.vertices.shape[1] for part in parts[:-1])])
        vertices = [part.vertices + shift for part, shift in zip(parts, away, strict=True)]
        faces = [part.faces + start for part, start in zip(parts, starts, strict=True)]
        return np.concatenate(vertices, axis=1), np.concatenate(faces).astype(np.int32)

    (vertices, faces), (body_vertices, body_faces) = (
        join(list(parts)) for parts in zip(*(clip.parts for clip in clips), strict=True)
    )
    return export.Clip(vertices, faces, clips[0].fps, body_vertices, body_faces)


def _evaluate_and_record(
    animator: Any,
    body: bodies.ShapedBody,
    motion: motions.Motion,
    *,
    truth: datasets.Dataset | None = None,
    run_in: float = 0.0,
) -> tuple[dict[str, Any], export.Clip]:
    """Returns the figures of all frames, and a clip of those after the run-in."""
    frames: list[Frame] = []
    evaluation: Evaluation = evaluate(animator, body, motion, truth=truth, keep=frames.append)
    fps, garment = evaluation.figures["fps"], animator.garment
    shown = frames[round(run_in * fps) :] or frames
    clip = record(shown, garment_name=garment.name, garment_faces=garment.faces, motion=motion, fps=fps)
    return evaluation.figures, clip


def _write(path: Path, clip: export.Clip, say: Say) -> None:
    for written in export.write(path, clip):
        say(str(written))


def _report(folder: Path, figures: dict[str, Any], say: Say) -> dict[str, Any]:
    with atomic_write(folder / "report.json") as temporary:
        temporary.write_text(json.dumps(figures, indent=1))
    say(str(folder / "report.json"))
    return figures


__all__ = ["demo", "demo_from_nothing"]
