"""Anchors: one garment settled in given poses on given shapes, with its derivatives there, in a dataset.

Animators of settled states are fitted to them (AgentDress, Wu et al. 2021, sections 3.2 to 3.4). The name of an anchor
is the hash of its inputs, so that a repeated command makes only what is missing.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from hemline.datasets import Dataset, Row, take_faults
from hemline.datasets.arm_lift import arm_lifts_deg
from hemline.errors import BadDataset
from hemline.garments.garment import Garment
from hemline.motions.motion import Pose
from hemline.sim.settings import SimSettings

from .anchor_jobs import LIFTED, AnchorTask, WalkRules, anchor_job, shape_key
from .jobs import Job, Progress, Report, run_jobs
from .setup import Setup
from .start_dataset import start_dataset
from .workers import workers

MAX_STAND_INS = 5
"""Number of poses that are tried before an anchor is abandoned."""


@dataclass(frozen=True)
class Anchor:
    """A pose and a shape in which a garment is settled."""

    pose: Pose
    betas: tuple[float, ...] = ()
    """Shape of the body; missing betas are 0."""


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
    """Settles a garment in many poses and shapes into a dataset; existing anchors are kept.

    Args:
        folder: The dataset; created if missing.
        garment: The garment, made on the body of `garment.body_name`.
        anchors: Poses and shapes to settle the garment in.
        turns: Joints whose derivatives are stored, three axes each.
        betas: Shape coefficients whose derivatives are stored.
        settings: Settings of the simulator.
        jobs: Number of processes. The results do not depend on it.
        scheduler: Address of a dask scheduler whose workers settle instead; see `workers`.
        report: Called with the number of an anchor, and 1 of 1, when it is done.

    Returns:
        The index row of each anchor; `failed` gives the reason if one could not be settled.

    Raises:
        BadBody: There are too many betas, or one is not finite.
        BadDataset: The folder holds another garment's takes, or one that cannot be read.
        BadInput: There is no such joint or shape coefficient.
        BadOutput: The folder cannot be written.
        BadCluster: No scheduler answers, it went away, or its workers cannot make the calls; finished takes are kept.
    """
    setup, tell = Setup.of(garment, settings), report or (lambda name, done, total: None)
    tasks = [AnchorTask(each.pose, shape_key(each.betas), tuple(turns), tuple(betas)) for each in anchors]
    for task in tasks:
        setup.body.shaped(task.shape)

    def anchor(dataset: Dataset, number: int, task: AnchorTask) -> Job[str]:
        take = yield from anchor_job(dataset, setup, task)
        tell(str(number), 1, 1)
        return take.name

    with workers(jobs, scheduler) as makers:
        dataset = start_dataset(folder, garment)
        names = run_jobs((anchor(dataset, number, task) for number, task in enumerate(tasks)), makers)
    rows = {row.name: row for row in dataset.rows()}
    return [rows[name] for name in names]


@dataclass(frozen=True)
class PosedTakes:
    """A garment walked into one pose on each of some shapes.

    Attributes:
        pose: The pose.
        names: Names of the takes, one for each shape on which the garment came to rest, in the order of the shapes.
        candidate: Number of the pose among its candidates, 0 for the one that was wanted.
    """

    pose: Pose
    names: tuple[str, ...]
    candidate: int = 0


def produce_posed(
    folder: str | Path,
    garment: Garment,
    candidates: Sequence[Sequence[Pose]],
    shapes: Sequence[Sequence[float]] = ((),),
    *,
    turns: Sequence[int] = (),
    rules: WalkRules = LIFTED,
    settings: SimSettings | None = None,
    jobs: int = 1,
    scheduler: str | None = None,
    report: Report | None = None,
) -> list[PosedTakes | None]:
    """Walks a garment into poses on each of some shapes, into a dataset; existing takes are kept.

    If the garment does not come to rest in a pose on one of the shapes, or a limb goes through the cloth there, or the
    cloth is torn, the next candidate replaces that pose. If no candidate does for all shapes, the one that does for
    most of them in their order is taken, and the others are left out. Failed takes stay in the dataset, with the
    reason.

    Args:
        folder: The dataset; created if missing.
        garment: The garment, made on the body of `garment.body_name`.
        candidates: For each anchor its pose, then the poses that may replace it.
        shapes: Betas of each body; missing ones are 0.
        turns: Joints whose derivatives are stored.
        rules: Whether arms were lifted in these poses, and how much of the cloth may be pinched.
        settings: Settings of the simulator.
        jobs: Number of processes. The results do not depend on it.
        scheduler: Address of a dask scheduler whose workers settle instead; see `workers`.
        report: Called with the number of an anchor, the shapes done and the total number of shapes.

    Returns:
        The takes of each anchor; None if the garment came to rest in no candidate on the first shape.

    Raises:
        BadBody: There are too many betas, or one is not finite.
        BadDataset: The folder holds another garment's takes, or one that cannot be read.
        BadOutput: The folder cannot be written.
        BadCluster: No scheduler answers, it went away, or its workers cannot make the calls; finished takes are kept.
    """
    setup, all_betas = Setup.of(garment, settings), [shape_key(each) for each in shapes]
    for betas in all_betas:
        setup.body.shaped(betas)
    with workers(jobs, scheduler) as makers:
        dataset = _open_for(folder, garment, rules)
        work = (
            _pose_job(dataset, setup, poses, all_betas, tuple(turns), rules, _progress_of(report, number))
            for number, poses in enumerate(candidates)
        )
        return run_jobs(work, makers)


def produce_scattered(
    folder: str | Path,
    garment: Garment,
    poses: Sequence[Pose],
    shapes: Sequence[Sequence[float]],
    *,
    turns: Sequence[int] = (),
    rules: WalkRules = LIFTED,
    settings: SimSettings | None = None,
    jobs: int = 1,
    scheduler: str | None = None,
    report: Report | None = None,
) -> list[PosedTakes | None]:
    """Walks a garment into one pose on each of many shapes, with the poses in turn; see `produce_posed`.

    Args:
        folder: The dataset; created if missing.
        garment: The garment, made on the body of `garment.body_name`.
        poses: The first shape gets the first pose, and so on; if the garment does not come to rest, the next poses
            replace it.
        shapes: Betas of each body; missing ones are 0.
        turns: Joints whose derivatives are stored.
        rules: Whether arms were lifted in these poses, and how much of the cloth may be pinched.
        settings: Settings of the simulator.
        jobs: Number of processes. The results do not depend on it.
        scheduler: Address of a dask scheduler whose workers settle instead; see `workers`.
        report: Called with the number of a shape, and 1 of 1, when it is done.

    Returns:
        The takes of each shape; None if the garment came to rest in no pose.
    """
    setup, attempts = Setup.of(garment, settings), min(MAX_STAND_INS, len(poses))

    def candidates(number: int) -> Iterator[Pose]:
        return (poses[(number + later) % len(poses)] for later in range(attempts))

    with workers(jobs, scheduler) as makers:
        dataset = _open_for(folder, garment, rules)
        work = (
            _pose_job(
                dataset,
                setup,
                tuple(candidates(number)),
                [shape_key(betas)],
                tuple(turns),
                rules,
                _progress_of(report, number),
            )
            for number, betas in enumerate(shapes)
        )
        return run_jobs(work, makers)


def _open_for(folder: str | Path, garment: Garment, rules: WalkRules) -> Dataset:
    """Opens a dataset in which garments are walked into poses, or makes it.

    Raises:
        BadDataset: It holds another garment's takes, or hanging arms are lifted by another angle in its poses.
        BadOutput: It cannot be written.
    """
    dataset = start_dataset(folder, garment)
    other = arm_lifts_deg(dataset) - {0.0, rules.lift_deg}
    if other and rules.lift_deg:
        known, cure = max(other), "drape into a new folder, since a model is fitted to poses that are lifted alike"
        got = f"{rules.lift_deg:g} degrees"
        raise BadDataset(f"hanging arms are lifted by {known:g} degrees in {dataset.folder}", got, cure)
    return dataset


def _progress_of(report: Report | None, number: int) -> Progress:
    """Returns a progress callback that reports under a number."""
    return lambda done, total: report(str(number), done, total) if report else None


def _pose_job(
    dataset: Dataset,
    setup: Setup,
    poses: Sequence[Pose],
    shapes: Sequence[tuple[float, ...]],
    turns: tuple[int, ...],
    rules: WalkRules,
    tell: Progress,
) -> Job[PosedTakes | None]:
    """Makes one anchor on all shapes, with the first candidate in which the garment comes to rest on all of them.

    If there is none, it is the candidate that got farthest, on all shapes on which the garment comes to rest.
    """
    best: list[str] = []
    chosen = 0
    for candidate, pose in enumerate(poses):
        names: list[str] = []
        for betas in shapes:
            name = yield from _settle_task(dataset, setup, AnchorTask(pose, betas, turns, rules=rules))
            if name is None:
                break
            names.append(name)
            tell(len(names), len(shapes))
        if len(names) > len(best):
            best, chosen = names, candidate
        if len(best) == len(shapes):
            break
    if not best:
        return None
    for betas in shapes[len(best) + 1 :]:
        name = yield from _settle_task(dataset, setup, AnchorTask(poses[chosen], betas, turns, rules=rules))
        best += [] if name is None else [name]
    return PosedTakes(poses[chosen], tuple(best), chosen)


def _settle_task(dataset: Dataset, setup: Setup, task: AnchorTask) -> Job[str | None]:
    """Makes an anchor; returns its name, or None if it cannot be fitted to."""
    take = yield from anchor_job(dataset, setup, task)
    if take.failed is not None or take_faults(take, setup.garment, setup.body.shaped(task.shape)).reason:
        return None
    return take.name
