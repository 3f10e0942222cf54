"""The test set of AgentDress: a garment walked into poses of other people, on random bodies and on the mean one."""

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hemline import bodies, motions
from hemline.arrays import Vertices
from hemline.datasets import open_dataset
from hemline.garments import Garment
from hemline.motions.motion import Pose
from hemline.motions.quaternions import from_axis_angle, multiply
from hemline.sim import produce_posed, random_shapes
from hemline.sim.takes.database import poses_of

CLIPS = ("run", "walk", "jump", "kick", "dance")
"""Shipped excerpts, no other clip of whose subjects is in a fit."""

SHAPES = 16
"""Random bodies, each with as many poses; the paper has 400 for each."""


@dataclass(frozen=True)
class Pair:
    """A pose with a random body, and the settled garment on both bodies."""

    pose: Pose
    betas: tuple[float, ...]
    mean: Vertices
    """On the mean body [m]."""
    worn: Vertices
    """On the random one [m]."""


def chosen(count: int, seed: int, body_name: str) -> list[tuple[Pose, tuple[float, ...]]]:
    """Poses of the clips with a random body each, arms lifted as in anchors."""
    body = bodies.load(body_name)
    poses = poses_of([motions.load(name) for name in CLIPS])
    shapes = random_shapes(body, SHAPES, seed)
    order = np.random.default_rng(seed).permutation(len(poses))[:count]
    rest = body.shaped().rest_pose.translation
    return [(Pose(poses[index], rest), shapes[number % SHAPES]) for number, index in enumerate(order)]


def settled_nearby(
    folder: Path, garment: Garment, poses: Sequence[Pose], *, turn: float, seed: int, jobs: int
) -> Iterator[tuple[int, Pose, Vertices]]:
    """The mean shape in poses with every joint turned a little, about an axis by chance: how steady the truth is.

    Args:
        folder: The dataset; what it lacks is settled now.
        garment: The garment.
        poses: The poses.
        turn: Of each joint [rad].
        seed: Of the axes.
        jobs: Processes.

    Yields:
        The number of each pose, the pose nearby, and the garment settled in it [m].
    """
    random = np.random.default_rng(seed)
    turned = []
    for pose in poses:
        axes = random.normal(size=(len(pose.rotations), 3))
        turns = from_axis_angle(turn * axes / np.linalg.norm(axes, axis=1, keepdims=True))
        turned.append(Pose(multiply(pose.rotations.astype(np.float64), turns).astype(np.float32), pose.translation))
    found = produce_posed(folder, garment, [[pose] for pose in turned], [()], jobs=jobs)
    dataset = open_dataset(folder)
    for number, (near, each) in enumerate(zip(turned, found, strict=True)):
        if each is not None:
            yield number, near, dataset.take(each.names[0]).vertices[0]


def settled_pairs(folder: Path, garment: Garment, *, count: int, seed: int, jobs: int) -> Iterator[Pair]:
    """All pairs in which the garment came to rest; what the folder lacks is settled now."""
    by_shape: dict[tuple[float, ...], list[Pose]] = {}
    for pose, betas in chosen(count, seed, garment.body_name):
        by_shape.setdefault(betas, []).append(pose)
    refused = 0
    for number, (betas, poses) in enumerate(by_shape.items()):
        found = produce_posed(folder, garment, [[pose] for pose in poses], [(), betas], jobs=jobs)
        dataset = open_dataset(folder)
        for pose, each in zip(poses, found, strict=True):
            if each is None:
                refused += 1
                continue
            mean, worn = (dataset.take(name).vertices[0] for name in each.names)
            yield Pair(pose, betas, mean, worn)
        done = f"{number + 1} of {len(by_shape)} bodies, {refused} pairs without rest"
        print(done, file=sys.stderr, flush=True)
