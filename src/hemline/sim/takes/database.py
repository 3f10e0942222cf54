"""The database of AgentDress: poses chosen from clips, and the garment settled in them on bodies of many shapes."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hemline import bodies
from hemline.arrays import Float
from hemline.bodies.lifted_arms import lifted_arms
from hemline.datasets import open_dataset
from hemline.datasets.joint_sensitivity import joint_weights, mean_sensitivity
from hemline.errors import BadInput
from hemline.garments.garment import Garment
from hemline.motions.motion import JOINT_COUNT, Motion, Pose
from hemline.motions.pose_clusters import PoseClusters, cluster_poses, without_heading
from hemline.sim.settings import SimSettings

from .anchors import MAX_STAND_INS, PosedTakes, produce_posed, produce_scattered
from .jobs import Report
from .rest_states import random_shapes, spread_shapes

SAMPLED_FPS, EVERY = 30.0, 4
"""Poses are every fourth frame of clips at this rate."""

SHAPES = 4
"""Of so many betas each is -2, -1, 1 and 2 in turn: seventeen shapes with the mean one."""

SEED_OF_BODIES = 1_000_000
"""Added to the seed for random bodies: others than those that a test is likely to draw."""


@dataclass(frozen=True)
class Database:
    """What was made.

    Attributes:
        clusters: Of the poses of the clips.
        weights: Of each joint, when poses are compared.
        anchors: What each cluster became; None where the garment came to rest in no pose of it.
        beside: The same of the poses on the mean shape alone.
        random: The same of the random bodies, each in a pose of `beside`, or of `anchors` without such.
        shapes: Betas of the bodies of the anchors.
    """

    clusters: PoseClusters
    weights: Float[np.ndarray, " joints"]
    anchors: list[PosedTakes | None]
    beside: list[PosedTakes | None]
    random: list[PosedTakes | None]
    shapes: list[tuple[float, ...]]


def make_database(
    folder: str | Path,
    garment: Garment,
    clips: Sequence[Motion],
    count: int,
    *,
    beside: int = 0,
    random: int = 0,
    derivatives: bool = False,
    seed: int = 0,
    jobs: int = 1,
    scheduler: str | None = None,
    settings: SimSettings | None = None,
    progress: Report | None = None,
) -> Database:
    """Settle a garment in the poses that stand for some clips, on seventeen shapes, into a dataset.

    First in the T-pose with derivatives by every joint, which say how much each joint counts; then in the poses in the
    middle of as many clusters as asked for, arms lifted off the torso (`lifted_arms`). What is there already is kept.

    Args:
        folder: The dataset; made when missing.
        garment: The garment.
        clips: Where the poses come from.
        count: Anchors.
        beside: Poses, in the middle of so many clusters of their own, in which it is settled on the mean shape alone:
            what poses do takes more of them to tell than what shapes do, and each costs a seventeenth.
        random: Bodies of random shapes, all betas drawn, on each of which it is settled in one pose, those beside the
            anchors in turn, or the anchors': the seventeen bodies know the first four betas alone, one at a time.
        derivatives: Settle it on the mean shape in each anchor's pose once more, with derivatives by every joint there:
            what sensitivity-optimised rigging learns from.
        seed: Another number begins the clustering elsewhere.
        jobs: Processes. What is made does not depend on it.
        scheduler: Address of a dask scheduler whose workers settle instead; see `workers`.
        settings: Settings of the simulator.
        progress: Called with what is made, what is done and what there is in all.

    Raises:
        BadInput: Fewer poses than anchors, or a body that has one shape.
        BadDataset: The folder holds another garment's takes.
        BadOutput: It cannot be written.
        BadCluster: No scheduler answers, it went away, or its workers cannot do it; what is done is kept.

    Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations", 2021,
        section 3.6. Differs: see `walk.WALK` and `lifted_arms` for how a garment comes into a pose.
    """
    tell = progress or (lambda stage, done, total: None)
    for name, number in (("poses beside the anchors", beside), ("random bodies", random)):
        if number < 0:
            raise BadInput(f"the number of {name} must not be negative", number, "leave it out for none")
    if count < 1:
        raise BadInput("the number of anchors must be positive", count, "the paper has 150")
    poses = poses_of(clips)
    body = bodies.load(garment.body_name)
    if not len(body.shapedirs):
        cure = "simulate it and fit ropes, or play it with live or lag"
        raise BadInput("anchors are for bodies of many shapes", f"'{body.name}', which has no betas", cure)
    shapes = spread_shapes(min(SHAPES, len(body.shapedirs)))
    rest = body.shaped().rest_pose.translation
    upright = Pose(np.tile([1.0, 0.0, 0.0, 0.0], (JOINT_COUNT, 1)), rest)
    stood = produce_scattered(
        folder,
        garment,
        [upright],
        shapes,
        turns=range(JOINT_COUNT),
        settings=settings,
        jobs=jobs,
        scheduler=scheduler,
        report=_counter(tell, "T-pose", len(shapes)),
    )
    dataset = open_dataset(folder)
    sensitivity = mean_sensitivity([dataset.take(each.names[0]) for each in stood if each is not None])
    weights = joint_weights(sensitivity)
    tell("clusters", 0, 1)
    clusters = cluster_poses(poses, weights, count, seed=seed)
    tell("clusters", 1, 1)
    single = cluster_poses(poses, weights, beside, seed=seed + 1).members if beside else ()
    more = produce_posed(
        folder,
        garment,
        [[Pose(poses[index], rest) for index in members[:MAX_STAND_INS]] for members in single],
        settings=settings,
        jobs=jobs,
        scheduler=scheduler,
        report=_counter(tell, "poses", beside),
    )

    def scatter(posed: list[PosedTakes | None]) -> list[PosedTakes | None]:
        settled = [each.pose for each in posed if each is not None]
        return produce_scattered(
            folder,
            garment,
            settled,
            random_shapes(body, random, seed + SEED_OF_BODIES) if settled else [],
            settings=settings,
            jobs=jobs,
            scheduler=scheduler,
            report=_counter(tell, "random bodies", random),
        )

    scattered = scatter(more) if beside else []
    candidates = [[Pose(poses[index], rest) for index in members[:MAX_STAND_INS]] for members in clusters.members]
    anchors = produce_posed(
        folder,
        garment,
        candidates,
        shapes,
        settings=settings,
        jobs=jobs,
        scheduler=scheduler,
        report=_counter(tell, "anchors", count * len(shapes)),
    )
    if derivatives:
        produce_posed(
            folder,
            garment,
            [[anchor.pose] for anchor in anchors if anchor is not None],
            turns=range(JOINT_COUNT),
            settings=settings,
            jobs=jobs,
            scheduler=scheduler,
            report=_counter(tell, "derivatives", count),
        )
    if not beside:
        scattered = scatter(anchors)
    return Database(clusters, weights, anchors, more, scattered, shapes)


def poses_of(clips: Sequence[Motion]) -> Float[np.ndarray, "poses joints 4"]:
    """Every fourth frame of clips: arms lifted, heading left out, single precision, as garments are settled in them."""
    found = []
    for clip in clips:
        motion = clip.resampled(SAMPLED_FPS)[::EVERY]
        found += [lifted_arms(motion[frame]).rotations for frame in range(len(motion))]
    return without_heading(np.asarray(found)).astype(np.float32).astype(np.float64)


def _counter(tell: Report, stage: str, total: int) -> Report:
    """Counts calls: those below it name one anchor each."""
    done = 0

    def report(name: str, one: int, of: int) -> None:
        nonlocal done
        done += 1
        tell(stage, min(done, total), total)

    return report
