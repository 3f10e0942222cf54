"""Anchors: one garment settled in given poses on given shapes, with its derivatives there, in a dataset.

What an animator of settled states learns from (AgentDress, Wu et al. 2021, sections 3.2 to 3.4). An anchor's name is
the hash of its inputs, so that a command that is run again makes only what is missing.
"""

import functools
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hemline import bodies
from hemline.datasets import Dataset, Row, Take, create, open_dataset, read_take, take_name
from hemline.errors import SimulationFailed
from hemline.garments.garment import Garment
from hemline.motions.motion import Motion, Pose
from hemline.sim.rest.rest import Rest
from hemline.sim.rest.sensitivities import Sensitivities
from hemline.sim.rest.settle import rest_state, settle
from hemline.sim.rest.settling import Method
from hemline.sim.rest.walk import WALK
from hemline.sim.settings import SimSettings

from .processes import Report, in_processes

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody


STAND_INS = 5
"""Poses that are tried before an anchor is given up."""


@dataclass(frozen=True)
class Anchor:
    """Where a garment is to be settled."""

    pose: Pose
    betas: tuple[float, ...] = ()
    """Shape of the body; what is left out is 0."""


def produce_anchors(
    folder: str | Path,
    garment: Garment,
    anchors: Sequence[Anchor],
    *,
    turns: Sequence[int] = (),
    betas: Sequence[int] = (),
    settings: SimSettings | None = None,
    jobs: int = 1,
    report: Report | None = None,
) -> list[Row]:
    """Settle a garment in many poses and shapes into a dataset; what is there already is kept.

    Args:
        folder: The dataset; made when missing.
        garment: The garment, made on the body of `garment.body_name`.
        anchors: Where to settle it.
        turns: Joints whose derivatives are stored, three axes each.
        betas: Shape coefficients whose derivatives are stored.
        settings: Settings of the simulator.
        jobs: Processes. What is made does not depend on it.
        report: Called with an anchor's number, and 1 of 1, when it is done.

    Returns:
        The index row of each anchor; `failed` says why one could not be settled.

    Raises:
        BadBody: Betas that are too many or not finite.
        BadDataset: The folder holds another garment's takes.
        BadInput: No such joint, no such shape coefficient.
        BadOutput: It cannot be written.
    """
    body, settings = bodies.load(garment.body_name), settings or SimSettings()
    for anchor in anchors:
        body.shaped(np.asarray(anchor.betas, np.float32))
    dataset = create(folder, garment)
    plan = _Derived(Path(folder), tuple(turns), tuple(betas), settings)
    work = [(plan, number, anchor) for number, anchor in enumerate(anchors)]
    names = in_processes(_anchor, work, jobs, report or (lambda name, done, total: None))
    rows = {row.name: row for row in dataset.rows()}
    return [rows[name] for name in names]


@dataclass(frozen=True)
class _Derived:
    """What anchors with derivatives have in common."""

    folder: Path
    turns: tuple[int, ...]
    betas: tuple[int, ...]
    settings: SimSettings


def _anchor(given: tuple[_Derived, int, Anchor], tell: Report) -> str:
    plan, number, anchor = given
    dataset = open_dataset(plan.folder)
    shaped = bodies.load(dataset.garment.body_name).shaped(np.asarray(anchor.betas, np.float32))
    take = _made(dataset, shaped, anchor.pose, plan.settings, turns=plan.turns, betas=plan.betas)
    tell(str(number), 1, 1)
    return take.name


@dataclass(frozen=True)
class Posed:
    """A garment walked into one pose on each of some shapes.

    Attributes:
        pose: The pose.
        names: Of the takes, one a shape.
    """

    pose: Pose
    names: tuple[str, ...]


@dataclass(frozen=True)
class _Plan:
    """All that a worker needs, small enough to be sent to another process."""

    folder: Path
    shapes: tuple[tuple[float, ...], ...]
    turns: tuple[int, ...]
    settings: SimSettings


def produce_posed(
    folder: str | Path,
    garment: Garment,
    candidates: Sequence[Sequence[Pose]],
    shapes: Sequence[Sequence[float]] = ((),),
    *,
    turns: Sequence[int] = (),
    settings: SimSettings | None = None,
    jobs: int = 1,
    report: Report | None = None,
) -> list[Posed | None]:
    """Walk a garment into poses on each of some shapes, into a dataset; what is there already is kept.

    A pose in which the garment does not come to rest on one of the shapes gives way to the next candidate. What failed
    stays in the dataset, with the reason.

    Args:
        folder: The dataset; made when missing.
        garment: The garment, made on the body of `garment.body_name`.
        candidates: For each anchor its pose, then those that may stand in for it.
        shapes: Betas of each body; what is left out is 0.
        turns: Joints whose derivatives are stored.
        settings: Settings of the simulator.
        jobs: Processes. What is made does not depend on it.
        report: Called with an anchor's number, the shapes done and the shapes in all.

    Returns:
        What each anchor became; None where no candidate came to rest.

    Raises:
        BadBody: Betas that are too many or not finite.
        BadDataset: The folder holds another garment's takes.
        BadOutput: It cannot be written.
    """
    body = bodies.load(garment.body_name)
    plan = _Plan(Path(folder), tuple(tuple(each) for each in shapes), tuple(turns), settings or SimSettings())
    for each in plan.shapes:
        body.shaped(np.asarray(each, np.float32))
    create(folder, garment)
    work = [(plan, number, tuple(each)) for number, each in enumerate(candidates)]
    return in_processes(_posed, work, jobs, report or (lambda name, done, total: None))


def produce_scattered(
    folder: str | Path,
    garment: Garment,
    poses: Sequence[Pose],
    shapes: Sequence[Sequence[float]],
    *,
    turns: Sequence[int] = (),
    settings: SimSettings | None = None,
    jobs: int = 1,
    report: Report | None = None,
) -> list[Posed | None]:
    """Walk a garment into one pose on each of many shapes, the poses in turn; see `produce_posed`.

    Args:
        folder: The dataset; made when missing.
        garment: The garment, made on the body of `garment.body_name`.
        poses: The first shape has the first pose, and so on; where it comes not to rest, the next ones stand in.
        shapes: Betas of each body; what is left out is 0.
        turns: Joints whose derivatives are stored.
        settings: Settings of the simulator.
        jobs: Processes. What is made does not depend on it.
        report: Called with a shape's number, and 1 of 1, when it is done.

    Returns:
        What each shape became; None where no pose came to rest.
    """
    create(folder, garment)
    work = []
    for number, betas in enumerate(shapes):
        plan = _Plan(Path(folder), (tuple(betas),), tuple(turns), settings or SimSettings())
        tried = min(STAND_INS, len(poses))
        work.append((plan, number, tuple(poses[(number + later) % len(poses)] for later in range(tried))))
    return in_processes(_posed, work, jobs, report or (lambda name, done, total: None))


def _posed(given: tuple[_Plan, int, tuple[Pose, ...]], tell: Report) -> Posed | None:
    """One anchor on all shapes, by the first candidate that comes to rest on all of them."""
    plan, number, poses = given
    dataset = open_dataset(plan.folder)
    body = bodies.load(dataset.garment.body_name)
    for pose in poses:
        names: list[str] = []
        for betas in plan.shapes:
            shaped = body.shaped(np.asarray(betas, np.float32))
            take = _made(dataset, shaped, pose, plan.settings, turns=plan.turns, method="walked")
            if take.failed is not None:
                break
            names.append(take.name)
            tell(str(number), len(names), len(plan.shapes))
        if len(names) == len(plan.shapes):
            return Posed(pose, tuple(names))
    return None


def anchor_inputs(
    garment: Garment,
    shaped: "ShapedBody",
    pose: Pose,
    settings: SimSettings,
    turns: Sequence[int],
    betas: Sequence[int],
    method: Method = "newton",
) -> dict[str, Any]:
    """What an anchor depends on; the hash of it is its name."""
    return {
        "kind": "anchor",
        "garment": garment.hash,
        "body": shaped.body.hash,
        "betas": [float(beta) for beta in shaped.betas],
        "pose": pose.hash,
        "settings": asdict(settings),
        "derivatives": {"turns": [int(joint) for joint in turns], "betas": [int(index) for index in betas]},
    } | ({"protocol": WALK.name} if method == "walked" else {})


def _made(
    dataset: Dataset,
    shaped: "ShapedBody",
    pose: Pose,
    settings: SimSettings,
    *,
    turns: Sequence[int] = (),
    betas: Sequence[int] = (),
    method: Method = "newton",
) -> Take:
    """The anchor of a pose on a shape, made where the dataset has none."""
    inputs = anchor_inputs(dataset.garment, shaped, pose, settings, turns, betas, method)
    path = dataset.path(take_name(inputs))
    if path.exists():
        return read_take(path)
    try:
        drape = None
        if method == "walked":
            drape = _drape(dataset.folder, tuple(map(float, shaped.betas)), settings)
            shaped = drape.shaped
        rest = settle(dataset.garment, shaped, pose, settings, start=drape, method=method)
        derivatives = derivatives_of(rest, turns, betas)
        take = replace(rest.take(), kind="anchor", inputs=inputs, derivatives=derivatives)
    except SimulationFailed as reason:
        take = _failed(dataset.garment, shaped, pose, settings, inputs, str(reason))
    dataset.add(take)
    return take


@functools.lru_cache(maxsize=64)
def _drape(folder: Path, betas: tuple[float, ...], settings: SimSettings) -> Rest:
    """Where all walks of a dataset's garment on a shape begin."""
    garment = open_dataset(folder).garment
    return rest_state(garment, bodies.load(garment.body_name).shaped(np.asarray(betas, np.float32)), settings)


def derivatives_of(rest: Rest, turns: Sequence[int], betas: Sequence[int]) -> dict[str, np.ndarray]:
    """Derivatives of a settled garment by the name that a take keeps them under, float32 (verts, 3) each.

    Args:
        rest: The settled garment.
        turns: Joints, about three axes of their own frame each [m/rad].
        betas: Shape coefficients [m].

    Raises:
        BadInput: No such joint, no such coefficient.
        SimulationFailed: The equilibrium is not isolated.
    """
    if not (len(turns) or len(betas)):
        return {}
    made = Sensitivities(rest)
    found = {f"turn.{joint}.{axis}": made.turn(joint, np.eye(3)[axis]) for joint in turns for axis in range(3)}
    found |= {f"beta.{index}": made.beta(index) for index in betas}
    return {name: value.astype(np.float32) for name, value in found.items()}


def _failed(
    garment: Garment, shaped: "ShapedBody", pose: Pose, settings: SimSettings, inputs: dict[str, Any], reason: str
) -> Take:
    """An anchor that could not be settled: the garment as it was made, and why."""
    motion = Motion(
        pose.rotations[None],
        pose.translation[None],
        fps=settings.fps,
        leg_length=shaped.leg_length,
        name="anchor",
    )
    return Take(
        kind="anchor",
        vertices=garment.vertices[None],
        motion=motion,
        betas=shaped.betas,
        lead_in=np.zeros(1, bool),
        pinched=np.zeros(1, np.int32),
        figures={},
        inputs=inputs,
        failed=reason,
    )
