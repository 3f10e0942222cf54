"""Anchors: one garment settled in given poses on given shapes, with its derivatives there, in a dataset.

What an animator of settled states learns from (AgentDress, Wu et al. 2021, sections 3.2 to 3.4). An anchor's name is
the hash of its inputs, so that a command that is run again makes only what is missing.
"""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hemline.datasets import Dataset, Row, Take
from hemline.errors import SimulationFailed
from hemline.garments.garment import Garment
from hemline.motions.motion import Motion, Pose
from hemline.sim.rest.rest import Rest
from hemline.sim.rest.sensitivities import Sensitivities
from hemline.sim.rest.settle import settle
from hemline.sim.rest.settling import Method
from hemline.sim.rest.walk import WALK
from hemline.sim.settings import SIMULATOR, SimSettings

from .start_dataset import start_dataset
from .jobs import Call, Job, Report, Progress, run_jobs
from .build_info import build_info
from .setup import Setup, drape, shaped
from .workers import workers

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody


MAX_STAND_INS = 5
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
    scheduler: str | None = None,
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
        scheduler: Address of a dask scheduler whose workers settle instead; see `workers`.
        report: Called with an anchor's number, and 1 of 1, when it is done.

    Returns:
        The index row of each anchor; `failed` says why one could not be settled.

    Raises:
        BadBody: Betas that are too many or not finite.
        BadDataset: The folder holds another garment's takes, or one that cannot be read.
        BadInput: No such joint, no such shape coefficient.
        BadOutput: It cannot be written.
        BadCluster: No scheduler answers, it went away, or its workers cannot do it; what is done is kept.
    """
    setup, tell = Setup.of(garment, settings), report or (lambda name, done, total: None)
    tasks = [_Task(each.pose, _shape_key(each.betas), tuple(turns), tuple(betas)) for each in anchors]
    for task in tasks:
        setup.body.shaped(task.shape)

    def anchor(dataset: Dataset, number: int, task: _Task) -> Job[str]:
        take = yield from _anchor_job(dataset, setup, task)
        tell(str(number), 1, 1)
        return take.name

    with workers(jobs, scheduler) as those:
        dataset = start_dataset(folder, garment)
        names = run_jobs((anchor(dataset, number, task) for number, task in enumerate(tasks)), those)
    rows = {row.name: row for row in dataset.rows()}
    return [rows[name] for name in names]


@dataclass(frozen=True)
class _Task:
    """One anchor: where the garment is settled, how, and with which derivatives."""

    pose: Pose
    shape: tuple[float, ...]
    turns: tuple[int, ...] = ()
    betas: tuple[int, ...] = ()
    method: Method = "newton"


@dataclass(frozen=True)
class PosedTakes:
    """A garment walked into one pose on each of some shapes.

    Attributes:
        pose: The pose.
        names: Of the takes, one a shape.
    """

    pose: Pose
    names: tuple[str, ...]


def produce_posed(
    folder: str | Path,
    garment: Garment,
    candidates: Sequence[Sequence[Pose]],
    shapes: Sequence[Sequence[float]] = ((),),
    *,
    turns: Sequence[int] = (),
    settings: SimSettings | None = None,
    jobs: int = 1,
    scheduler: str | None = None,
    report: Report | None = None,
) -> list[PosedTakes | None]:
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
        scheduler: Address of a dask scheduler whose workers settle instead; see `workers`.
        report: Called with an anchor's number, the shapes done and the shapes in all.

    Returns:
        What each anchor became; None where no candidate came to rest.

    Raises:
        BadBody: Betas that are too many or not finite.
        BadDataset: The folder holds another garment's takes, or one that cannot be read.
        BadOutput: It cannot be written.
        BadCluster: No scheduler answers, it went away, or its workers cannot do it; what is done is kept.
    """
    setup, given = Setup.of(garment, settings), [_shape_key(each) for each in shapes]
    for betas in given:
        setup.body.shaped(betas)
    with workers(jobs, scheduler) as those:
        dataset = start_dataset(folder, garment)
        work = (
            _pose_job(dataset, setup, poses, given, tuple(turns), _numbered(report, number))
            for number, poses in enumerate(candidates)
        )
        return run_jobs(work, those)


def produce_scattered(
    folder: str | Path,
    garment: Garment,
    poses: Sequence[Pose],
    shapes: Sequence[Sequence[float]],
    *,
    turns: Sequence[int] = (),
    settings: SimSettings | None = None,
    jobs: int = 1,
    scheduler: str | None = None,
    report: Report | None = None,
) -> list[PosedTakes | None]:
    """Walk a garment into one pose on each of many shapes, the poses in turn; see `produce_posed`.

    Args:
        folder: The dataset; made when missing.
        garment: The garment, made on the body of `garment.body_name`.
        poses: The first shape has the first pose, and so on; where it comes not to rest, the next ones stand in.
        shapes: Betas of each body; what is left out is 0.
        turns: Joints whose derivatives are stored.
        settings: Settings of the simulator.
        jobs: Processes. What is made does not depend on it.
        scheduler: Address of a dask scheduler whose workers settle instead; see `workers`.
        report: Called with a shape's number, and 1 of 1, when it is done.

    Returns:
        What each shape became; None where no pose came to rest.
    """
    setup, tried = Setup.of(garment, settings), min(MAX_STAND_INS, len(poses))

    def turned(number: int) -> Iterator[Pose]:
        return (poses[(number + later) % len(poses)] for later in range(tried))

    with workers(jobs, scheduler) as those:
        dataset = start_dataset(folder, garment)
        work = (
            _pose_job(dataset, setup, tuple(turned(number)), [_shape_key(betas)], tuple(turns), _numbered(report, number))
            for number, betas in enumerate(shapes)
        )
        return run_jobs(work, those)


def _shape_key(betas: Sequence[float]) -> tuple[float, ...]:
    return tuple(float(beta) for beta in np.asarray(betas, np.float32))


def _numbered(report: Report | None, number: int) -> Progress:
    return lambda done, total: report(str(number), done, total) if report else None


def _pose_job(
    dataset: Dataset,
    setup: Setup,
    poses: Sequence[Pose],
    shapes: Sequence[tuple[float, ...]],
    turns: tuple[int, ...],
    tell: Progress,
) -> Job[PosedTakes | None]:
    """One anchor on all shapes, by the first candidate that comes to rest on all of them."""
    for pose in poses:
        names: list[str] = []
        for betas in shapes:
            take = yield from _anchor_job(dataset, setup, _Task(pose, betas, turns, method="walked"))
            if take.failed is not None:
                break
            names.append(take.name)
            tell(len(names), len(shapes))
        if len(names) == len(shapes):
            return PosedTakes(pose, tuple(names))
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
        "simulator": SIMULATOR,
        "derivatives": {"turns": [int(joint) for joint in turns], "betas": [int(index) for index in betas]},
    } | ({"protocol": WALK.name} if method == "walked" else {})


def _anchor_job(dataset: Dataset, setup: Setup, task: _Task) -> Job[Take]:
    """The anchor of a pose on a shape, made where the dataset has none."""
    body = setup.body.shaped(task.shape)
    inputs = anchor_inputs(setup.garment, body, task.pose, setup.settings, task.turns, task.betas, task.method)
    found = dataset.kept(inputs)
    if found is not None:
        return found
    take = yield Call(_anchor, setup, task)
    take = replace(take, inputs=inputs)
    dataset.add(take)
    return take


def _anchor(setup: Setup, task: _Task, tell: Progress) -> Take:
    """An anchor, or why there is none, as a take."""
    garment, body = setup.garment, shaped(setup, task.shape)
    try:
        start = None
        if task.method == "walked":
            start = drape(setup, task.shape)
            body = start.shaped
        rest = settle(garment, body, task.pose, setup.settings, start=start, method=task.method)
        derivatives = derivatives_of(rest, task.turns, task.betas)
        return replace(rest.take(), kind="anchor", derivatives=derivatives, made_with=build_info())
    except SimulationFailed as reason:
        return _failed_take(garment, body, task.pose, setup.settings, str(reason))


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


def _failed_take(garment: Garment, shaped: "ShapedBody", pose: Pose, settings: SimSettings, reason: str) -> Take:
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
        inputs={},
        failed=reason,
        made_with=build_info(),
    )
