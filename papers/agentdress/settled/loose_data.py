"""Anchors of a loose garment on few poses and bodies, and its test set of clips on the mean and on random bodies."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hemline import bodies, motions
from hemline.datasets import Take, open_dataset
from hemline.datasets.joint_sensitivity import joint_weights, mean_sensitivity
from hemline.garments import Garment
from hemline.motions.motion import JOINT_COUNT, Motion, Pose
from hemline.motions.pose_clusters import cluster_poses
from hemline.sim import produce, produce_posed, random_shapes
from hemline.sim.takes.anchors import MAX_STAND_INS, produce_scattered
from hemline.sim.takes.database import sample_poses
from hemline.sim.takes.produce import ClipRequest

SHAPES = [(), *((*[0.0] * index, value) for index in range(4) for value in (-2.0, 2.0))]
"""Nine of the seventeen shapes of `hemline drape --anchors`, as each has to be simulated in every pose."""


def make_anchors(folder: Path, garment: Garment, clips: list[str], *, count: int, seed: int, jobs: int = 1) -> None:
    """Settles a garment in representative poses of clips on nine shapes, fewer than `hemline drape --anchors`.

    Args:
        folder: The dataset, made if missing and continued.
        garment: The garment.
        clips: Clips that the poses come from.
        count: Number of anchors.
        seed: Seed of the clusters.
        jobs: Number of processes.
    """
    rest = bodies.load(garment.body_name).shaped().rest_pose.translation
    upright = Pose(np.tile([1.0, 0.0, 0.0, 0.0], (JOINT_COUNT, 1)), rest)
    results = produce_scattered(folder, garment, [upright], SHAPES, turns=range(JOINT_COUNT), jobs=jobs)
    dataset = open_dataset(folder)
    weights = joint_weights(
        mean_sensitivity([dataset.take(each.names[0]) for each in results if each is not None], dataset.body)
    )
    poses = sample_poses([_clean_motion(name) for name in clips])
    members = cluster_poses(poses, weights, count, seed=seed).members
    candidates = [[Pose(poses[index], rest) for index in each[:MAX_STAND_INS]] for each in members]
    produce_posed(folder, garment, candidates, SHAPES, jobs=jobs)


def _clean_motion(name: str) -> Motion:
    motion = motions.open_motion(name)
    first, last = motions.longest_clean(motion)
    return motion[first:last]


BETAS = 4
"""Number of random betas of a body, as for close-fitting garments in `watched.py`."""


@dataclass(frozen=True)
class Trial:
    """One clip, simulated on the mean body and on another body in the same poses.

    Attributes:
        clip: Name of the clip.
        body: Number of the other body.
        betas: Shape of the other body.
        mean: Take on the mean body.
        truth: Take on the other body.
    """

    clip: str
    body: int
    betas: tuple[float, ...]
    mean: Take
    truth: Take


def make_trials(
    folder: Path, garment: Garment, clips: Sequence[str], *, count: int, seconds: float, seed: int, jobs: int = 1
) -> list[Trial]:
    """Simulates all clips on all bodies.

    Limbs are lifted out of each other on the mean body, so that all bodies take the same poses.

    Args:
        folder: The dataset, made if missing and continued.
        garment: The garment.
        clips: Names of shipped clips.
        count: Number of random bodies.
        seconds: Length of each clip [s].
        seed: Seed of the bodies.
        jobs: Number of processes.
    """
    body = bodies.load(garment.body_name)
    plain = body.shaped()
    requests = []
    for name in clips:
        motion = motions.load(name)
        motion = motion[: round(seconds * motion.fps)]
        requests.append(ClipRequest(plain.untangle_motion(plain.placed(motion)), name))
    trials = []
    for number, betas in enumerate([(), *(each[:BETAS] for each in random_shapes(body, count, seed))]):
        rows = produce(folder, garment, requests, betas=betas, untangle=False, jobs=jobs)
        takes = [open_dataset(folder).take(row) for row in rows]
        if number == 0:
            means = takes
            continue
        for name, mean, truth in zip(clips, means, takes, strict=True):
            if truth.failed is None:
                trials.append(Trial(name, number, betas, mean, truth))
    return trials
