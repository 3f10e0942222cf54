"""`hemline evaluate MODEL --motion FILE`."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from hemline.cli.clip import Up, cut
from hemline.cli.progress import bars


@dataclass(frozen=True)
class EvaluateOptions:
    """Options of `hemline evaluate`."""

    model: Annotated[str, tyro.conf.Positional]
    """Model to measure: a file, or the name of a shipped model."""
    motion: Annotated[str, tyro.conf.arg(aliases=["-m"])]
    """Clip to play: a BVH, FBX, GLB or SMPL .npz file, or the name of a shipped excerpt."""
    garment: str | None = None
    """Garment to dress, by name or file, for a model that plays any garment."""
    material: str | None = None
    """Material of the garment, if the model knows several: cotton, silk, denim, wool, jersey or paper.
    Defaults to the material of the model or of the garment."""
    over: tuple[str, ...] = ()
    """Layers over the garment, from the inside out.
    They are garments for a model that plays any garment, otherwise models with garments of their own.
    By default there are none."""
    thickness_mm: float = 1.5
    """Minimum distance of a garment that is pushed off the one beneath, above 0 and at most 10 [mm]."""
    body: str | None = None
    """Body to play on, with the topology of the model's body.
    A model that plays any garment takes any body or character file. Defaults to the body of the model."""
    betas: tuple[float, ...] = ()
    """Shape coefficients of the body, about -3 to 3 each. Missing coefficients are 0, which is the mean shape."""
    clamp_betas: bool = False
    """Clamp the betas to the range that the model was fitted on.
    Without it, betas outside the range cause a warning."""
    truth: Path | None = None
    """Dataset folder with simulated takes of this clip, the ground truth for errors.
    By default no errors are measured."""
    drive: Literal["own", "truth"] = "own"
    """Source of the bone motion: the animator's own dynamics (own), or the simulated vertices of --truth (truth)."""
    fps: float = 30.0
    """Frame rate to play [frames/s]. With --truth, the frame rate of the takes is used."""
    up: Up | None = None
    """Axis that is up in the clip, such as z, or -y as in a camera's coordinates (--up=-y).
    By default it is found from the body: up is where the head is."""
    start: float = 0.0
    """Start time in the clip [s]. With --truth, the whole clip is played and measured from this time on."""
    seconds: float | None = None
    """Length of the clip to measure [s]. Defaults to the rest of the clip."""
    threads: int | None = None
    """Number of threads of compiled code. Defaults to the number of cores."""
    untangle: bool = True
    """Move limbs that overlap in the clip out of each other first, since no cloth fits between them."""
    whole: bool = True
    """Keep the cloth in one piece.
    With --no-whole, the output of the animator is pushed out of the body vertex by vertex."""
    detail: float = 1.0
    """Fraction of the garment's vertices to play, above 0 and at most 1."""
    picture: Path | None = None
    """Picture of the worst frame to write (.png), beside the ground truth if --truth is given.
    By default none is written."""
    json: bool = False
    """Print one JSON object on stdout instead of a table."""


def run(options: EvaluateOptions) -> int:
    """Measures and prints; returns status 1 if a vertex was inside the body after the projection."""
    from hemline import datasets, motions
    from hemline.animators import model_path
    from hemline.arrays import Quaternions
    from hemline.cli.limbs import note_untangled
    from hemline.cli.model import open_model, warn_new_poses
    from hemline.compiled import use_threads
    from hemline.errors import BadInput
    from hemline.files import check_writable
    from hemline.metrics import model_mb
    from hemline.playback import Frame, evaluate
    from hemline.playback.worst import draw_worst

    if options.picture is not None:
        check_writable(options.picture)
    if options.threads is not None and options.threads < 1:
        raise BadInput("--threads must be at least 1", options.threads, "leave it out for all cores")
    use_threads(options.threads)
    motion = motions.open_motion(options.motion, up=options.up)
    part = cut(motion, options.start, options.seconds)
    truth = None if options.truth is None else datasets.open_dataset(options.truth)
    animator, body = open_model(
        options.model,
        options.garment,
        options.body,
        options.betas,
        over=options.over,
        material=options.material,
        clamp=options.clamp_betas,
    )
    novelties: list[float | None] = []
    rotations: list[Quaternions] = []
    with bars() as display:
        task = display.add_task("evaluate", total=round(part.seconds * options.fps) + 1)

        def keep(frame: Frame) -> None:
            novelties.append(frame.novelty)
            rotations.append(frame.body.pose.rotations)
            display.advance(task)

        evaluation = evaluate(
            animator,
            body,
            part if truth is None else motion,
            truth=truth,
            drive=options.drive,
            fps=options.fps,
            untangle=options.untangle,
            whole=options.whole,
            detail=options.detail,
            thickness_mm=options.thickness_mm,
            start=0.0 if truth is None else options.start,
            seconds=None if truth is None else options.seconds,
            keep=keep,
        )
    warn_new_poses(animator, novelties)
    if truth is None:
        note_untangled(part.resample(options.fps), rotations)
    layers = options.over if options.garment is None else ()  # with --garment, the layers are garments, not models
    size = sum(model_mb(model_path(name)) for name in (options.model, *layers))
    figures: dict[str, Any] = {"model": options.model, "model_mb": size} | evaluation.figures
    if options.picture is not None:
        draw_worst(options.picture, evaluation, evaluation.garment.faces)
    print(json.dumps(figures) if options.json else table(figures))
    return 0 if figures["inside_percent"]["after"] == 0 else 1


def table(figures: dict[str, Any]) -> str:
    """Formats figures as lines of name and value, nested names joined by a dot."""
    return "\n".join(f"{name:<34} {_format(value)}" for name, value in _flat(figures, ""))


def _flat(value: Any, name: str) -> list[tuple[str, Any]]:
    if isinstance(value, dict):
        return [row for key, inner in value.items() for row in _flat(inner, f"{name}.{key}" if name else key)]
    return [(name, value)]


def _format(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else "-" if value is None else str(value)
