"""`hemline drape GARMENT -o DATASET --spread 4`, `--anchors 150 --motion FILE...`, or `--tour 300`."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from hemline.cli.clip import Up
from hemline.cli.progress import bars, note, stages, try_on_progress
from hemline.errors import BadInput

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody
    from hemline.garments import Garment
    from hemline.motions import Motion


LEAST_ANCHORS = 2
"""Number of anchors that a fit needs."""


@dataclass(frozen=True)
class DrapeOptions:
    """Options of `hemline drape`."""

    garment: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="GARMENT")]
    """Garment to settle, by name or file. Names are cape, skirt, tshirt, longsleeve, trousers and dress.
    Light meshes end in -light.
    Generated garments are KIND:SEED, or KIND:SEED@EDGE with an edge in mm, such as dress:7@35."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])]
    """Dataset folder to write. It is created if missing, and continued if it exists."""
    material: str | None = None
    """Material of the garment: cotton, silk, denim, wool, jersey or paper. Defaults to the garment's own material."""
    tryon: bool = True
    """Try a mesh on first if it does not sit on the body. With --no-tryon it is used as it is, or refused."""
    spread: int = 0
    """Number of betas to vary one at a time: each adds four bodies, at -2, -1, 1 and 2, to the mean body."""
    random: int = 0
    """Number of additional bodies of random shape.
    With --anchors, each is settled in one pose of --poses or --far, or of the anchors."""
    seed: int = 0
    """Seed of the random bodies and of the choice of poses."""
    anchors: int = 0
    """Number of poses to settle on all bodies of --spread 4. The verb fit with --animator agentdress needs them.
    With 0, the garment is settled in the rest pose."""
    poses: int = 0
    """Number of additional poses to settle on the mean body alone. They are cheap and improve the pose model."""
    far: int = 0
    """Number of additional poses to settle on the mean body alone, each the farthest from all others of the clips.
    These are rare ones, such as high kicks, in which cloth tears if a model knows nothing like them."""
    hanging: int = 0
    """Number of additional poses with hanging arms to settle on the mean body alone, and on a third of --random.
    In other poses arms are lifted off the torso, which leaves room for cloth, and a model has to lift them, too."""
    tour: int = 0
    """Number of poses that one moving body passes through, in each of which the garment is kept.
    They cost a third of --poses, and the verb fit needs no anchors then, but follows the skin on other bodies.
    Without --motion they are poses of many people."""
    poses_of: Path | None = None
    """Dataset folder of which --poses poses are settled again in --material on the mean body.
    The verb fit learns the effect of the material from both datasets. By default no poses are reused."""
    derivatives: bool = False
    """Compute the derivatives by every joint at each anchor too, for sensitivity-optimised rigging."""
    motion: Annotated[tuple[str, ...], tyro.conf.arg(aliases=["-m"])] = ()
    """Clips to choose the anchor poses from: .bvh, .fbx, .glb or SMPL .npz files, or names of shipped excerpts."""
    up: Up | None = None
    """Axis that is up in the files of clips, such as z, or -y as in a camera's coordinates (--up=-y).
    By default it is found from the body: up is where the head is."""
    jobs: int = 1
    """Number of drapes to settle in parallel, one process each. The result does not depend on it."""
    scheduler: str | None = None
    """Address of a dask scheduler, such as tcp://host:8786, whose workers do the work; see docs/scale.md.
    By default it is done on this machine."""
    body: str = "anny24"
    """Body to use: anny24, or a file (.safetensors, a .glb or .vrm character, or SMPL .npz or .pkl)."""
    json: bool = False
    """Print one JSON object with the dataset and its shapes, poses or anchors instead of a table."""


def run(options: DrapeOptions) -> int:
    """Settles the garment; returns status 1 if it failed on a shape."""
    from hemline import bodies
    from hemline.sim import axis_shapes, produce_rests, random_shapes

    body = bodies.load(options.body)
    other_poses = (options.anchors, options.poses, options.far, options.hanging, options.poses_of is not None)
    if options.tour and any(other_poses):
        raise BadInput("--tour stands alone", "other poses", "give them in a second run into the same folder")
    if bool(options.anchors) != bool(options.motion) and not options.tour:
        raise BadInput("--anchors and --motion belong together", "one of them", "give both, or neither")
    if options.poses and not options.anchors and options.poses_of is None:
        raise BadInput("--poses stand beside --anchors, or are those of --poses-of", "neither", "give one of the two")
    for name in ("far", "hanging"):
        if getattr(options, name) and not options.anchors:
            raise BadInput(f"--{name} poses stand beside --anchors", "no --anchors", "give both")
    if options.derivatives and not options.anchors:
        raise BadInput("--derivatives are those at the anchors", "no --anchors", "give both")
    if options.jobs < 1:
        raise BadInput("--jobs must be at least 1", options.jobs, "leave it out for 1")
    for name in ("spread", "random", "seed", "anchors", "poses", "far", "hanging", "tour"):
        if getattr(options, name) < 0:
            raise BadInput(f"--{name} must not be negative", getattr(options, name), "give 0 or more")
    if options.spread > len(body.shapedirs):
        raise BadInput(f"--spread: {body.name} has {len(body.shapedirs)} betas", options.spread, "give fewer")
    if options.poses_of is not None:
        return _in_poses_of(options, options.poses_of)
    if options.tour:
        return _tour(options)
    if options.anchors:
        return _anchors(options)
    shapes = [*axis_shapes(options.spread), *random_shapes(body, options.random, options.seed)]
    garment = _garment(options, body.shaped())
    with bars() as display:
        task = display.add_task(garment.name, total=len(shapes))
        rests = produce_rests(
            options.output,
            garment,
            shapes,
            jobs=options.jobs,
            scheduler=options.scheduler,
            report=lambda done, total: display.update(task, completed=done, total=total),
        )
    rows = [
        {"betas": list(betas), "reason": rest, "figures": {}}
        if isinstance(rest, str)
        else {"betas": list(betas), "reason": None, "figures": {key: float(v) for key, v in rest.figures.items()}}
        for betas, rest in zip(shapes, rests, strict=True)
    ]
    if options.json:
        print(json.dumps({"dataset": str(options.output), "shapes": rows}))
    else:
        for row in rows:
            shape = " ".join(f"{beta:.3g}" for beta in row["betas"]) or "0"
            figures = "  ".join(f"{key} {value:.3g}" for key, value in row["figures"].items())
            print(f"betas {shape}:  {row['reason'] or figures}")
    return 1 if any(row["reason"] for row in rows) else 0


def _say_if_loose(options: DrapeOptions, garment: "Garment", shaped: "ShapedBody") -> None:
    """Prints a line before the anchors are settled if most of the garment hangs, which settled anchors cannot show."""
    from hemline.garments.hanging import HANGING_DISTANCE, MOSTLY_HANGS, hanging_percent
    from hemline.sim import produce_rests

    (rest,) = produce_rests(options.output, garment, [()])
    if isinstance(rest, str):
        return  # the poses fail for the same reason, and say so
    percent = hanging_percent(rest.vertices[0], garment.faces, shaped)
    if percent > MOSTLY_HANGS:
        note(
            f"most of '{garment.name}' hangs, {percent:.0f} % of it farther than "
            f"{100 * HANGING_DISTANCE:.0f} cm from the skin, and settled poses have no swing: fit ropes to what "
            f"'hemline simulate {options.garment} -m {' '.join(options.motion)} -o TAKES' makes"
        )


def _garment(options: DrapeOptions, shaped: "ShapedBody") -> "Garment":
    """Opens the garment, in the material of the options, and tries it on if it does not sit on the body."""
    from hemline.tryon import open_garment

    with try_on_progress() as progress:
        return open_garment(
            options.garment,
            shaped,
            tryon="auto" if options.tryon else "never",
            dressed=False,
            material=options.material,
            dataset=options.output,
            say=note,
            progress=progress,
        )


def _in_poses_of(options: DrapeOptions, folder: Path) -> int:
    """Settles the garment of a dataset in its poses, in another material; returns status 1 if none came to rest."""
    from hemline import bodies
    from hemline.datasets import open_dataset
    from hemline.sim import produce_in_poses_of

    for name in ("spread", "random", "anchors", "derivatives"):
        if getattr(options, name):
            raise BadInput("--poses-of settles on the mean body alone, in --poses poses", f"--{name}", "leave it out")
    other = open_dataset(folder)
    garment = _garment(options, bodies.load(options.body).shaped())
    with bars() as display:
        task = display.add_task(f"{garment.name}, {garment.material.name}", total=options.poses)
        rests = produce_in_poses_of(
            options.output,
            garment,
            other,
            options.poses,
            seed=options.seed,
            jobs=options.jobs,
            scheduler=options.scheduler,
            report=lambda number, done, total: display.advance(task),
        )
    settled = sum(rest is not None for rest in rests)
    if options.json:
        rows = [{"pose": number, "takes": list(rest.names) if rest else []} for number, rest in enumerate(rests)]
        print(json.dumps({"dataset": str(options.output), "poses": rows}))
    else:
        print(f"{settled} of {len(rests)} poses, {garment.material.name}")
    if settled < len(rests):
        note(f"{len(rests) - settled} of {len(rests)} poses are left out, as no pose of their cluster came to rest")
    return 0 if settled else 1


def _clips(options: DrapeOptions) -> "list[Motion]":
    """Returns the longest part without jumps of each clip."""
    from hemline import motions

    clips = []
    for path in options.motion:
        motion = motions.open_motion(path, up=options.up)
        first, last = motions.longest_clean(motion)
        clips.append(motion[first:last])
    return clips


def _tour(options: DrapeOptions) -> int:
    """Keeps the garment in the poses of a tour; returns status 1 if there are too few of them for a fit."""
    from hemline import bodies, motions
    from hemline.sim import make_tour

    shaped = bodies.load(options.body).shaped()
    garment = _garment(options, shaped)
    _say_if_loose(options, garment, shaped)
    with stages() as progress:
        count = make_tour(
            options.output,
            garment,
            _clips(options) or [motions.varied_poses()],
            options.tour,
            tour=options.output.with_name(f"{options.output.name}-tour"),
            seed=options.seed,
            jobs=options.jobs,
            scheduler=options.scheduler,
            progress=progress,
        )
    made = {"dataset": str(options.output), "poses": count}
    print(json.dumps(made) if options.json else f"{count} poses on one body")
    if left_out := options.tour - count:
        note(f"{left_out} of {options.tour} poses are left out: the clips lack them, or the cloth was torn")
    return 0 if count >= LEAST_ANCHORS else 1


def _anchors(options: DrapeOptions) -> int:
    """Settles anchors; returns status 1 if so few came to rest that no model can be fitted to them."""
    from hemline import bodies
    from hemline.sim import make_database

    clips = _clips(options)
    shaped = bodies.load(options.body).shaped()
    garment = _garment(options, shaped)
    _say_if_loose(options, garment, shaped)
    with stages() as progress:
        database = make_database(
            options.output,
            garment,
            clips,
            options.anchors,
            beside=options.poses,
            far=options.far,
            hanging=options.hanging,
            random=options.random,
            derivatives=options.derivatives,
            seed=options.seed,
            jobs=options.jobs,
            scheduler=options.scheduler,
            progress=progress,
        )
    rows = [
        {"cluster": number, "poses": len(members), "takes": list(anchor.names) if anchor else []}
        for number, (members, anchor) in enumerate(zip(database.clusters.members, database.anchors, strict=True))
    ]
    found, beside, far, hanging, random = (
        sum(each is not None for each in takes)
        for takes in (database.anchors, database.beside, database.far, database.hanging, database.random)
    )
    if options.json:
        print(json.dumps({"dataset": str(options.output), "anchors": rows}))
    else:
        poses = sum(row["poses"] for row in rows)
        print(f"{found} anchors on {len(database.shapes)} bodies, {beside} more on one, of {poses} poses")
        if far:
            print(f"{far} poses far from these on one body")
        if hanging:
            print(f"{hanging} poses with hanging arms on one body")
        if random:
            print(f"{random} random bodies in these poses")
    if shortfall := database.shortfall():
        note(shortfall)
    if found < LEAST_ANCHORS:
        note(
            f"a fit of agentdress needs {LEAST_ANCHORS} anchors, got {found}: raise --anchors or name calmer clips, or "
            f"fit ropes to what 'hemline simulate {options.garment}' makes"
        )
    return 0 if found >= LEAST_ANCHORS else 1
