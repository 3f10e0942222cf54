"""`hemline simulate GARMENT --motion FILE... -o DATASET`."""

import json
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from hemline.errors import BadInput

from .garment import open_garment
from .progress import note, total

FASTEST = 1000
"""Frames a second beyond which nobody simulates on purpose."""


@dataclass(frozen=True)
class Arguments:
    """Simulate a garment against clips."""

    garment: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="GARMENT")]
    """A garment by name (cape, skirt, tshirt, longsleeve, trousers, dress; light ones: cape-light ...; generated ones:
    dress:7, top:1@35 ...), or a file."""
    motion: Annotated[tuple[str, ...], tyro.conf.arg(aliases=["-m"])]
    """Clips: .bvh or AMASS .npz files, or names of shipped ones: run, walk, dance ..."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])]
    """The dataset, a folder; made when missing, continued when there."""
    material: str | None = None
    """Of another material than its own: cotton, silk, denim, wool, jersey, paper; not those over it."""
    over: tuple[str, ...] = ()
    """More garments, worn over the first one, from the skin outwards."""
    tryon: bool = True
    """Try a mesh on first that does not sit on the body; otherwise it is taken as it lies, or refused."""
    betas: tuple[float, ...] = ()
    """Shape of the body: a few numbers of about -3 to 3; what is left out is 0, the mean."""
    jobs: int = 1
    """Clips that are simulated at the same time, each in a process of its own; the result does not depend on it."""
    scheduler: str | None = None
    """Address of a dask scheduler, such as tcp://host:8786, whose workers simulate instead; see docs/scale.md."""
    seconds: float | None = None
    """Only the first so many seconds of each clip; all of it unless given."""
    fps: float = 30.0
    """Frames a second that are stored, 1 to 1000."""
    body: str = "anny24"
    """The body: anny24, or a file (.safetensors; a character, .glb or .vrm; SMPL .npz or .pkl)."""
    untangle: bool = True
    """First move limbs out of each other where they overlap in the clip."""
    whole: bool = False
    """Take the whole clip, jumps and all; otherwise its longest stretch without jumps."""
    quantised: bool = False
    """Store vertices in steps of 10 micrometres: smaller files."""
    explain: bool = False
    """Say what was guessed about garment and clips, and why."""
    json: bool = False
    """Print the takes as a JSON list instead of a table."""
    wind: tuple[float, float, float] = field(default=(0.0, 0.0, 0.0))
    """Wind along x, y (up) and z [m/s]; its mean where there are gusts."""
    gusts: float = 0.0
    """How strong gusts are: standard deviation of the wind in each direction [m/s]; 0 for none."""
    gust_seed: int = 0
    """Another number gives other gusts of that strength."""


def run(arguments: Arguments) -> int:
    """Simulate; status 1 when a take failed."""
    from hemline import bodies, garments
    from hemline.sim import Clip, SimSettings, produce

    if arguments.jobs < 1:
        raise BadInput("--jobs must be at least 1", arguments.jobs, "leave it out for 1")
    if not 1 <= arguments.fps <= FASTEST:
        raise BadInput(f"--fps must be from 1 to {FASTEST}", arguments.fps, "leave it out for 30 frames a second")
    if arguments.seconds is not None and not 0 < arguments.seconds < math.inf:
        raise BadInput("--seconds must be positive", arguments.seconds, "leave it out for the whole clip")
    if not arguments.motion:
        raise BadInput("no clips", "--motion without a file", "name BVH or npz files after --motion")
    clips = [Clip(*_clip(path, arguments)) for path in arguments.motion]
    settings = SimSettings(fps=arguments.fps, wind=arguments.wind, gusts=arguments.gusts, gust_seed=arguments.gust_seed)
    shaped = bodies.load(arguments.body).shaped(arguments.betas)
    mean = bodies.load(arguments.body).shaped()
    # one garment is simulated from the shape that it was made on; several need one shape
    each = [
        open_garment(
            name, mean, arguments.output, tryon=arguments.tryon, dressed=bool(arguments.over), material=material
        )
        for name, material in ((arguments.garment, arguments.material), *((name, None) for name in arguments.over))
    ]
    garment = garments.worn_together(each) if arguments.over else each[0]
    if arguments.explain:
        note(garments.explain(garment))
    with total("frames") as report:
        rows = produce(
            arguments.output,
            garment,
            clips,
            betas=tuple(float(b) for b in shaped.betas),
            settings=settings,
            untangle=arguments.untangle,
            jobs=arguments.jobs,
            scheduler=arguments.scheduler,
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
