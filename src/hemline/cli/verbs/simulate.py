"""`hemline simulate GARMENT --motion FILE... -o DATASET`."""

import json
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from hemline.cli.clip import Up
from hemline.cli.progress import note, total, try_on_progress
from hemline.errors import BadInput

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody
    from hemline.garments import Garment

MAX_FPS = 1000
"""Highest frame rate accepted [frames/s]; higher ones are most likely mistakes."""


@dataclass(frozen=True)
class SimulateOptions:
    """Options of `hemline simulate`."""

    garment: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="GARMENT")]
    """Garment to simulate, by name or file. Names are cape, skirt, tshirt, longsleeve, trousers and dress.
    Light meshes end in -light.
    Generated garments are KIND:SEED, or KIND:SEED@EDGE with an edge in mm, such as dress:7@35."""
    motion: Annotated[tuple[str, ...], tyro.conf.arg(aliases=["-m"])]
    """Clips to simulate: .bvh, .fbx, .glb or SMPL .npz files, or names of excerpts such as run or walk."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])]
    """Dataset folder to write. It is created if missing, and continued if it exists."""
    material: str | None = None
    """Material of the garment: cotton, silk, denim, wool, jersey or paper. Garments given by --over keep their own.
    Defaults to the garment's own material."""
    over: tuple[str, ...] = ()
    """Garments to layer over the first one, from the inside out. By default there are none."""
    tryon: bool = True
    """Try a mesh on first if it does not sit on the body. With --no-tryon it is used as it is, or refused."""
    betas: tuple[float, ...] = ()
    """Shape coefficients of the body, about -3 to 3 each. Missing coefficients are 0, which is the mean shape."""
    jobs: int = 1
    """Number of clips to simulate in parallel, one process each. The result does not depend on it."""
    scheduler: str | None = None
    """Address of a dask scheduler, such as tcp://host:8786, whose workers do the work; see docs/scale.md.
    By default it is done on this machine."""
    up: Up | None = None
    """Axis that is up in the files of clips, such as z, or -y as in a camera's coordinates (--up=-y).
    By default it is found from the body: up is where the head is."""
    seconds: float | None = None
    """Length of each clip to simulate, from its start [s]. Defaults to the whole clip."""
    fps: float = 30.0
    """Frame rate to store, 1 to 1000 [frames/s]."""
    body: str = "anny24"
    """Body to use: anny24, or a file (.safetensors, a .glb or .vrm character, or SMPL .npz or .pkl)."""
    untangle: bool = True
    """Move limbs that overlap in the clip out of each other first."""
    whole: bool = False
    """Simulate the whole clip, including jumps. Without it, the longest section without jumps is simulated."""
    quantised: bool = False
    """Store vertices in steps of 10 micrometres, for smaller files."""
    explain: bool = False
    """Report what was guessed about the garment and the clips, and why."""
    json: bool = False
    """Print one JSON object with the dataset and its takes instead of a table."""
    wind: tuple[float, float, float] = field(default=(0.0, 0.0, 0.0))
    """Wind velocity along x, y (up) and z [m/s]. With --gusts it is the mean."""
    gusts: float = 0.0
    """Standard deviation of the wind in each direction [m/s]. With 0 there are no gusts."""
    gust_seed: int = 0
    """Seed of the gusts. Another seed gives other gusts of the same strength."""


def run(options: SimulateOptions) -> int:
    """Simulates the clips; returns status 1 if a take failed."""
    from hemline import bodies, garments
    from hemline.sim import ClipRequest, SimSettings, produce
    from hemline.tryon import open_garment

    if options.jobs < 1:
        raise BadInput("--jobs must be at least 1", options.jobs, "leave it out for 1")
    if not 1 <= options.fps <= MAX_FPS:
        raise BadInput(f"--fps must be from 1 to {MAX_FPS}", options.fps, "leave it out for 30 frames a second")
    if options.seconds is not None and not 0 < options.seconds < math.inf:
        raise BadInput("--seconds must be positive", options.seconds, "leave it out for the whole clip")
    if not options.motion:
        raise BadInput("no clips", "--motion without a file", "name BVH or npz files after --motion")
    clips = [ClipRequest(*_open_clip(path, options)) for path in options.motion]
    settings = SimSettings(fps=options.fps, wind=options.wind, gusts=options.gusts, gust_seed=options.gust_seed)
    shaped = bodies.load(options.body).shaped(options.betas)
    mean = bodies.load(options.body).shaped()
    # several layers must share one shape; a single garment starts from the shape it was made on
    with try_on_progress() as progress:
        layers = [
            open_garment(
                name,
                mean,
                tryon="auto" if options.tryon else "never",
                dressed=bool(options.over),
                material=material,
                dataset=options.output,
                say=note,
                progress=progress,
            )
            for name, material in ((options.garment, options.material), *((name, None) for name in options.over))
        ]
    garment = garments.wear_together(layers) if options.over else layers[0]
    if options.explain:
        note(garments.explain(garment))
    if not options.over:
        _say_if_close(options, garment, mean)
    with total("frames") as report:
        rows = produce(
            options.output,
            garment,
            clips,
            betas=tuple(float(b) for b in shaped.betas),
            settings=settings,
            untangle=options.untangle,
            jobs=options.jobs,
            scheduler=options.scheduler,
            quantised=options.quantised,
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
            "fault": row.faults.reason,
            "figures": row.figures,
        }
        for i, row in enumerate(rows)
    ]
    if options.json:
        print(json.dumps({"dataset": str(options.output), "takes": takes}))
    else:
        for take in takes:
            state = (
                f"failed: {take['reason']}"
                if take["failed"]
                else "  ".join(f"{k} {v:.3g}" for k, v in take["figures"].items())
            )
            print(f"{take['clip']:<16} part {take['part']}  {take['frames']:>4} frames  {state}")
            if take["fault"]:
                print(f"{'':<16} fits leave it out: {take['fault']}")
    return 1 if any(take["failed"] for take in takes) else 0


def _say_if_close(options: SimulateOptions, garment: "Garment", shaped: "ShapedBody") -> None:
    """Prints a line before the clips are simulated if little of the garment hangs."""
    from hemline.garments.hanging import HANGING_DISTANCE, LITTLE_HANGS, hanging_percent

    percent = hanging_percent(garment.vertices, garment.faces, shaped)
    if percent < LITTLE_HANGS:
        note(
            f"little of '{garment.name}' hangs, {percent:.0f} % of its cloth is farther than "
            f"{100 * HANGING_DISTANCE:.0f} cm from the skin: for a model, fit agentdress to what 'hemline drape "
            f"{options.garment} --anchors 4 --poses 40 --random 10 -m {' '.join(options.motion)} -o DRAPES' makes"
        )


def _open_clip(path: str, options: SimulateOptions):
    from hemline import motions

    motion = motions.open_motion(path, up=options.up)
    if options.explain:
        for line in motion.notes:
            note(f"{path}: {line}")
    if not options.whole:
        first, last = motions.longest_clean(motion)
        motion = motion[first:last]
    if options.seconds is not None:
        motion = motion[: max(2, round(options.seconds * motion.fps) + 1)]
    return motion, motions.subject_of(motion)
