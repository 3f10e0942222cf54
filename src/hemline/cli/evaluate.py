"""`hemline evaluate MODEL --motion FILE`."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from .clip import cut


@dataclass(frozen=True)
class Arguments:
    """Measure a model on a motion."""

    model: Annotated[str, tyro.conf.Positional]
    """A model file, or the name of a shipped model."""
    motion: Annotated[str, tyro.conf.arg(aliases=["-m"])]
    """A clip, or the name of a shipped excerpt."""
    garment: str | None = None
    """The garment to wear, by name or a file, for a model that was fitted on many."""
    material: str | None = None
    """What it is made of, where the model knows others than its own: cotton, silk, denim, wool, jersey, paper."""
    over: tuple[str, ...] = ()
    """What is worn over it, from the skin outwards, as for `hemline animate`."""
    thickness_mm: float = 1.5
    """How far a garment keeps off the one beneath it, where it must be moved, above 0 and at most 10 [mm]."""
    body: str | None = None
    """Another body of the same topology, or any for a model that takes any; left out: the model's."""
    betas: tuple[float, ...] = ()
    """Shape of the body."""
    clamp_betas: bool = False
    """Move them into the range in which the model is believed, see the warning that it gives without."""
    truth: Path | None = None
    """A dataset with simulated takes of this clip, to measure errors against."""
    drive: Literal["own", "truth"] = "own"
    """Bones from the animator's own ropes, or from the truth."""
    fps: float = 30.0
    """Frames a second, where there is no truth."""
    start: float = 0.0
    """Where in the clip to begin [s]; with ground truth, where in it to begin to measure."""
    seconds: float | None = None
    """How much of the clip; left out: to its end [s]."""
    threads: int | None = None
    """Threads of compiled code; left out: as many as there are cores."""
    untangle: bool = False
    """Lift limbs out of each other first."""
    whole: bool = True
    """Keep the cloth in one piece; without, what the animator makes, moved out of the body vertex by vertex."""
    detail: float = 1.0
    """Share of the garment's vertices, above 0 and at most 1."""
    picture: Path | None = None
    """A PNG of the worst frame, beside the truth where there is one."""
    json: bool = False
    """Print one JSON object and nothing else on stdout."""


def run(arguments: Arguments) -> int:
    """Measure and print; status 1 if a vertex was inside the body after the projection."""
    from hemline import datasets, motions
    from hemline.animators import model_path
    from hemline.compiled import use_threads
    from hemline.errors import BadInput
    from hemline.files import check_writable
    from hemline.metrics import model_mb
    from hemline.playback import evaluate
    from hemline.playback.worst import draw_worst

    from .model import open_model, warn_new_poses

    if arguments.picture is not None:
        check_writable(arguments.picture)
    if arguments.threads is not None and arguments.threads < 1:
        raise BadInput("--threads must be at least 1", arguments.threads, "leave it out for all cores")
    use_threads(arguments.threads)
    motion = motions.open_motion(arguments.motion)
    part = cut(motion, arguments.start, arguments.seconds)
    truth = None if arguments.truth is None else datasets.open_dataset(arguments.truth)
    animator, body = open_model(
        arguments.model,
        arguments.garment,
        arguments.body,
        arguments.betas,
        over=arguments.over,
        material=arguments.material,
        clamp=arguments.clamp_betas,
    )
    novelties: list[float | None] = []
    evaluation = evaluate(
        animator,
        body,
        part if truth is None else motion,
        truth=truth,
        drive=arguments.drive,
        fps=arguments.fps,
        untangle=arguments.untangle,
        whole=arguments.whole,
        detail=arguments.detail,
        thickness_mm=arguments.thickness_mm,
        start=0.0 if truth is None else arguments.start,
        seconds=None if truth is None else arguments.seconds,
        keep=lambda frame: novelties.append(frame.novelty),
    )
    warn_new_poses(animator, novelties)
    worn = arguments.over if arguments.garment is None else ()  # else garments, which are no models
    size = sum(model_mb(model_path(name)) for name in (arguments.model, *worn))
    figures: dict[str, Any] = {"model": arguments.model, "model_mb": size} | evaluation.figures
    if arguments.picture is not None:
        draw_worst(arguments.picture, evaluation, evaluation.garment.faces)
    print(json.dumps(figures) if arguments.json else table(figures))
    return 0 if figures["inside_percent"]["after"] == 0 else 1


def table(figures: dict[str, Any]) -> str:
    """Figures as lines of name and value, nested names joined by a dot."""
    return "\n".join(f"{name:<34} {_shown(value)}" for name, value in _flat(figures, ""))


def _flat(value: Any, name: str) -> list[tuple[str, Any]]:
    if isinstance(value, dict):
        return [row for key, inner in value.items() for row in _flat(inner, f"{name}.{key}" if name else key)]
    return [(name, value)]


def _shown(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else "-" if value is None else str(value)
