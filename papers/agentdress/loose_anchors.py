"""Anchors of a loose garment: few poses, on the mean body and on two for each of the first betas."""

from pathlib import Path

import numpy as np

from hemline import bodies, motions
from hemline.datasets import open_dataset
from hemline.datasets.joint_sensitivity import joint_weights, mean_sensitivity
from hemline.garments import Garment
from hemline.motions.motion import JOINT_COUNT, Motion, Pose
from hemline.motions.pose_clusters import cluster_poses
from hemline.sim import produce_posed
from hemline.sim.takes.anchors import MAX_STAND_INS, produce_scattered
from hemline.sim.takes.database import poses_of

SHAPES = [(), *((*[0.0] * index, value) for index in range(4) for value in (-2.0, 2.0))]
"""Half of the seventeen of `hemline drape --anchors`: each costs a walk in every pose."""


def make_anchors(folder: Path, garment: Garment, clips: list[str], *, count: int, seed: int, jobs: int = 1) -> None:
    """Settle a garment in the poses that stand for some clips, on nine shapes; what is there already is kept.

    As `hemline drape --anchors` does (`sim.make_database`), with fewer shapes.

    Args:
        folder: The dataset.
        garment: The garment.
        clips: Where the poses come from.
        count: Anchors.
        seed: Of the clusters.
        jobs: Processes.
    """
    rest = bodies.load(garment.body_name).shaped().rest_pose.translation
    upright = Pose(np.tile([1.0, 0.0, 0.0, 0.0], (JOINT_COUNT, 1)), rest)
    stood = produce_scattered(folder, garment, [upright], SHAPES, turns=range(JOINT_COUNT), jobs=jobs)
    dataset = open_dataset(folder)
    weights = joint_weights(mean_sensitivity([dataset.take(each.names[0]) for each in stood if each is not None]))
    poses = poses_of([_clean(name) for name in clips])
    members = cluster_poses(poses, weights, count, seed=seed).members
    candidates = [[Pose(poses[index], rest) for index in each[:MAX_STAND_INS]] for each in members]
    produce_posed(folder, garment, candidates, SHAPES, jobs=jobs)


def _clean(name: str) -> Motion:
    motion = motions.open_motion(name)
    first, last = motions.longest_clean(motion)
    return motion[first:last]
