"""`hemline drape GARMENT -o DATASET --spread 4`, or `--anchors 150 --motion FILE...`."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from hemline.errors import BadInput

from .garment import open_garment
from .progress import bars, stages

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody
    from hemline.garments import Garment


@dataclass(frozen=True)
class Arguments:
    """Settle a garment at rest, on bodies of many shapes; and in poses that stand for some clips."""

    garment: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="GARMENT")]
    """A garment by name (cape, skirt, tshirt, longsleeve, trousers, dress; light ones: cape-light ...; generated ones:
    dress:7, top:1@35 ...), or a file."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])]
    """The dataset, a folder; made when missing, continued when there."""
    material: str | None = None
    """Of another material than its own: cotton, silk, denim, wool, jersey, paper."""
    tryon: bool = True
    """Try a mesh on first that does not sit on the body; otherwise it is taken as it lies, or refused."""
    spread: int = 0
    """Besides the mean body, bodies where one of the first so many betas is -2, -1, 1 or 2: four for each."""
    random: int = 0
    """Besides these, so many random bodies; with --anchors, each in one of the --poses, or of the anchors."""
    seed: int = 0
    """Another number gives other random bodies."""
    anchors: int = 0
    """Settle it in so many poses, too, on the bodies of --spread 4: what 'fit --animator agentdress' learns from."""
    poses: int = 0
    """Besides the anchors, so many poses on the mean body alone: cheap, and they make the pose model better."""
    poses_of: Path | None = None
    """Settle it in --poses of that dataset's poses on the mean body, with --material: 'fit' learns from both what the
    material does."""
    derivatives: bool = False
    """At each anchor, derivatives by every joint, too: what sensitivity-optimised rigging learns from."""
    motion: Annotated[tuple[str, ...], tyro.conf.arg(aliases=["-m"])] = ()
    """Clips that the poses are taken from: .bvh or AMASS .npz files, or names of shipped ones."""
    jobs: int = 1
    """Poses that are settled at the same time, each in a process of its own; the result does not depend on it."""
    scheduler: str | None = None
    """Address of a dask scheduler, such as tcp://host:8786, whose workers settle instead; see docs/scale.md."""
    body: str = "anny24"
    """The body: anny24, or a file (.safetensors; a character, .glb or .vrm; SMPL .npz or .pkl)."""
    json: bool = False
    """Print the drapes as a JSON list instead of a table."""


def run(arguments: Arguments) -> int:
    """Drape; status 1 when there is a shape on which the garment could not be settled."""
    from hemline import bodies
    from hemline.sim import produce_rests, random_shapes, spread_shapes

    body = bodies.load(arguments.body)
    if bool(arguments.anchors) != bool(arguments.motion):
        raise BadInput("--anchors and --motion belong together", "one of them", "give both, or neither")
    if arguments.poses and not arguments.anchors and arguments.poses_of is None:
        raise BadInput("--poses stand beside --anchors, or are those of --poses-of", "neither", "give one of the two")
    if arguments.derivatives and not arguments.anchors:
        raise BadInput("--derivatives are those at the anchors", "no --anchors", "give both")
    if arguments.jobs < 1:
        raise BadInput("--jobs must be at least 1", arguments.jobs, "leave it out for 1")
    for name in ("spread", "random", "seed", "anchors", "poses"):
        if getattr(arguments, name) < 0:
            raise BadInput(f"--{name} must not be negative", getattr(arguments, name), "give 0 or more")
    if arguments.spread > len(body.shapedirs):
        raise BadInput(f"--spread: {body.name} has {len(body.shapedirs)} betas", arguments.spread, "give fewer")
    if arguments.poses_of is not None:
        return _in_poses_of(arguments, arguments.poses_of)
    if arguments.anchors:
        return _anchors(arguments)
    shapes = [*spread_shapes(arguments.spread), *random_shapes(body, arguments.random, arguments.seed)]
    garment = _garment(arguments, body.shaped())
    with bars() as display:
        task = display.add_task(garment.name, total=len(shapes))
        found = produce_rests(
            arguments.output,
            garment,
            shapes,
            jobs=arguments.jobs,
            scheduler=arguments.scheduler,
            report=lambda done, total: display.update(task, completed=done, total=total),
        )
    rows = [
        {"betas": list(betas), "reason": rest, "figures": {}}
        if isinstance(rest, str)
        else {"betas": list(betas), "reason": None, "figures": {key: float(v) for key, v in rest.figures.items()}}
        for betas, rest in zip(shapes, found, strict=True)
    ]
    if arguments.json:
        print(json.dumps(rows))
    else:
        for row in rows:
            shape = " ".join(f"{beta:.3g}" for beta in row["betas"]) or "0"
            figures = "  ".join(f"{key} {value:.3g}" for key, value in row["figures"].items())
            print(f"betas {shape}:  {row['reason'] or figures}")
    return 1 if any(row["reason"] for row in rows) else 0


def _garment(arguments: Arguments, shaped: "ShapedBody") -> "Garment":
    """The garment, of the material that is asked for."""
    name, folder = arguments.garment, arguments.output
    return open_garment(name, shaped, folder, tryon=arguments.tryon, material=arguments.material)


def _in_poses_of(arguments: Arguments, folder: Path) -> int:
    """The garment of a dataset in its poses, of another material; status 1 when it came to rest in fewer than asked."""
    from hemline import bodies
    from hemline.datasets import open_dataset
    from hemline.sim import produce_in_poses_of

    for name in ("spread", "random", "anchors", "derivatives"):
        if getattr(arguments, name):
            raise BadInput("--poses-of settles on the mean body alone, in --poses poses", f"--{name}", "leave it out")
    other = open_dataset(folder)
    garment = _garment(arguments, bodies.load(arguments.body).shaped())
    with bars() as display:
        task = display.add_task(f"{garment.name}, {garment.material.name}", total=arguments.poses)
        made = produce_in_poses_of(
            arguments.output,
            garment,
            other,
            arguments.poses,
            seed=arguments.seed,
            jobs=arguments.jobs,
            scheduler=arguments.scheduler,
            report=lambda number, done, total: display.advance(task),
        )
    settled = sum(each is not None for each in made)
    if arguments.json:
        rows = [{"pose": number, "takes": list(each.names) if each else []} for number, each in enumerate(made)]
        print(json.dumps(rows))
    else:
        print(f"{settled} of {len(made)} poses, {garment.material.name}")
    return 1 if settled < len(made) else 0


def _anchors(arguments: Arguments) -> int:
    """Anchors; status 1 when there is a cluster of poses in none of which the garment came to rest."""
    from hemline import bodies, motions
    from hemline.sim import make_database

    clips = []
    for path in arguments.motion:
        motion = motions.open_motion(path)
        first, last = motions.longest_clean(motion)
        clips.append(motion[first:last])
    shaped = bodies.load(arguments.body).shaped()
    garment = _garment(arguments, shaped)
    with stages() as progress:
        made = make_database(
            arguments.output,
            garment,
            clips,
            arguments.anchors,
            beside=arguments.poses,
            random=arguments.random,
            derivatives=arguments.derivatives,
            seed=arguments.seed,
            jobs=arguments.jobs,
            scheduler=arguments.scheduler,
            progress=progress,
        )
    rows = [
        {"cluster": number, "poses": len(members), "takes": list(anchor.names) if anchor else []}
        for number, (members, anchor) in enumerate(zip(made.clusters.members, made.anchors, strict=True))
    ]
    lost = [row["cluster"] for row in rows if not row["takes"]]
    beside = sum(each is not None for each in made.beside)
    if arguments.json:
        print(json.dumps(rows))
    else:
        poses = sum(row["poses"] for row in rows)
        random = sum(each is not None for each in made.random)
        print(f"{len(rows) - len(lost)} anchors on {len(made.shapes)} bodies, {beside} more on one, of {poses} poses")
        if random:
            print(f"{random} random bodies in these poses")
        if lost:
            print(f"in no pose of these clusters did the garment come to rest: {lost}")
    return 1 if lost else 0
