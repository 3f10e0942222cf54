"""`hemline simulate GARMENT --motion FILE... -o DATASET`."""

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from hemline.errors import BadInput

from .garment import open_garment
from .progress import bars, note


@dataclass(frozen=True)
class Arguments:
    """Simulate a garment against clips."""

    garment: Annotated[str, tyro.conf.Positional]
    """A garment by name (cape, skirt, tshirt, longsleeve, trousers, dress; light ones: cape-light ...), or a file."""
    motion: Annotated[tuple[str, ...], tyro.conf.arg(aliases=["-m"])]
    """Clips: .bvh or AMASS .npz files, or names of shipped ones: run, walk, dance ..."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])]
    """The dataset, a folder; made when missing, continued when there."""
    over: tuple[str, ...] = ()
    """Garments worn over it, from the skin outwards."""
    tryon: bool = True
    """Try a mesh on that does not sit on the body; otherwise refuse it."""
    betas: tuple[float, ...] = ()
    """Shape of the body; what is left out is 0."""
    jobs: int = 1
    """Processes; the takes do not depend on it."""
    seconds: float | None = None
    """Only so much of each clip [s]."""
    fps: float = 30.0
    """Frames a second."""
    body: str = "anny24"
    """The body by name, or a body file."""
    untangle: bool = True
    """Lift limbs out of each other first."""
    whole: bool = False
    """The whole clip; otherwise its longest stretch without jumps."""
    quantised: bool = False
    """Store vertices in steps of 10 micrometres."""
    explain: bool = False
    """Say what was guessed about garment and clips, and why."""
    json: bool = False
    """Print a JSON list of takes and nothing else on stdout."""
    wind: tuple[float, float, float] = field(default=(0.0, 0.0, 0.0))
    """Wind, or its mean where there are gusts [m/s]."""
    gusts: float = 0.0
    """Standard deviation of the wind in each direction; 0: it is constant [m/s]."""
    gust_seed: int = 0
    """Which of all such gusts."""


def run(arguments: Arguments) -> int:
    """Simulate; status 1 when a take failed."""
    from hemline import bodies, garments
    from hemline.sim import Clip, SimSettings, produce

    if arguments.jobs < 1:
        raise BadInput("--jobs must be at least 1", arguments.jobs, "leave it out for 1")
    if arguments.seconds is not None and arguments.seconds <= 0:
        raise BadInput("--seconds must be positive", arguments.seconds, "leave it out for the whole clip")
    if not arguments.motion:
        raise BadInput("no clips", "--motion without a file", "name BVH or npz files after --motion")
    clips = [Clip(*_clip(path, arguments)) for path in arguments.motion]
    settings = SimSettings(fps=arguments.fps, wind=arguments.wind, gusts=arguments.gusts, gust_seed=arguments.gust_seed)
    shaped = bodies.load(arguments.body).shaped(arguments.betas)
    mean = bodies.load(arguments.body).shaped()
    # one garment is simulated from the shape that it was made on; several need one shape
    each = [
        open_garment(name, mean, arguments.output, tryon=arguments.tryon, dressed=bool(arguments.over))
        for name in (arguments.garment, *arguments.over)
    ]
    garment = garments.worn_together(each) if arguments.over else each[0]
    if arguments.explain:
        note(garments.explain(garment))
    with bars() as display:
        tasks: dict[str, int] = {}

        def report(clip: str, done: int, total: int) -> None:
            if clip not in tasks:
                tasks[clip] = display.add_task(clip, total=total)
            display.update(tasks[clip], completed=done, total=total)

        rows = produce(
            arguments.output,
            garment,
            clips,
            betas=tuple(float(b) for b in shaped.betas),
            settings=settings,
            untangle=arguments.untangle,
            jobs=arguments.jobs,
            quantised=arguments.quantised,
            report=report,
        )
    takes = [
        {
            "take": i,
            "name": row.name,
            "clip": row.clip,
            "part": row.part,
            "frames": row.frames,
            "failed": row.failed is not None,
            "reason": row.failed,
            "figures": row.figures,
        }
        for i, row in enumerate(rows)
    ]
    if arguments.json:
        print(json.dumps(takes))
    else:
        for take in takes:
            state = (
                f"failed: {take['reason']}"
                if take["failed"]
                else "  ".join(f"{k} {v:.3g}" for k, v in take["figures"].items())
            )
            print(f"{take['clip']:<16} part {take['part']}  {take['frames']:>4} frames  {state}")
    return 1 if any(take["failed"] for take in takes) else 0


def _clip(path: str, arguments: Arguments):
    from hemline import motions

    motion = motions.open_motion(path)
    if arguments.explain:
        for line in motion.notes:
            note(f"{path}: {line}")
    if not arguments.whole:
        first, last = motions.longest_clean(motion)
        motion = motion[first:last]
    if arguments.seconds is not None:
        motion = motion[: max(2, round(arguments.seconds * motion.fps) + 1)]
    return motion, motions.subject_of(motion)
