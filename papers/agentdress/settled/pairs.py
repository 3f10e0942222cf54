"""The test sets of AgentDress: a garment settled in poses of other people, on random bodies and on the mean one."""

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hemline import bodies, motions
from hemline.arrays import Int, Vertices
from hemline.datasets import open_dataset
from hemline.garments import Garment
from hemline.motions.motion import Pose
from hemline.motions.pose_clusters import cluster_poses, without_heading
from hemline.motions.quaternions import from_axis_angle, multiply
from hemline.sim import produce_posed, random_shapes
from hemline.sim.takes.anchor_jobs import HANGING
from hemline.sim.takes.database import SAMPLE_STRIDE, SAMPLED_FPS, sample_poses

CLIPS = ("run", "walk", "jump", "kick", "dance")
"""Shipped excerpts of people who appear in no fit."""

SHAPES = 16
"""Number of random bodies, with as many poses each; the paper has 400 poses for each."""


@dataclass(frozen=True)
class Worn:
    """A pose of a clip as a player shows it, a body, and the garment settled on it [m]."""

    clip: str
    pose: Pose
    betas: tuple[float, ...]
    vertices: Vertices
    pinched: int
    """Number of vertices without a free place."""


@dataclass(frozen=True)
class Pair:
    """A pose and a random body, with the settled garment on this and on the mean body."""

    pose: Pose
    betas: tuple[float, ...]
    mean: Vertices
    """The garment on the mean body [m]."""
    worn: Vertices
    """The garment on the random body [m]."""


def mean_distance_mm(vertices: np.ndarray, others: np.ndarray) -> float:
    """Returns the mean distance between corresponding vertices [mm]."""
    return 1e3 * float(np.linalg.norm(np.asarray(vertices, np.float64) - others, axis=1).mean())


def choose_pairs(count: int, seed: int, body_name: str) -> list[tuple[Pose, tuple[float, ...]]]:
    """Draws poses of the clips, arms lifted as in anchors, each with the betas of a random body."""
    body = bodies.load(body_name)
    poses = sample_poses([motions.load(name) for name in CLIPS])
    shapes = random_shapes(body, SHAPES, seed)
    order = np.random.default_rng(seed).permutation(len(poses))[:count]
    rest = body.shaped().rest_pose.translation
    return [(Pose(poses[index], rest), shapes[number % SHAPES]) for number, index in enumerate(order)]


def cluster_centres(rotations: np.ndarray, weights: np.ndarray, count: int, seed: int = 0) -> Int[np.ndarray, " count"]:
    """Returns the indices of the poses in the middle of `count` clusters."""
    members = cluster_poses(rotations.astype(np.float64), weights, count, seed=seed).members
    return np.array([each[0] for each in members])


def settle_in_poses(
    folder: Path, garment: Garment, poses: Sequence[Pose], betas: tuple[float, ...] = (), *, jobs: int
) -> list[Vertices | None]:
    """Settles a garment in poses on one body; what the folder already holds is not simulated again.

    Returns:
        The garment in each pose [m]; None where it did not come to rest.
    """
    results = produce_posed(folder, garment, [[pose] for pose in poses], [betas], jobs=jobs)
    dataset = open_dataset(folder)
    return [None if result is None else dataset.take(result.names[0]).vertices[0] for result in results]


def settle_nearby(
    folder: Path, garment: Garment, poses: Sequence[Pose], *, turn: float, seed: int, jobs: int
) -> Iterator[tuple[int, Pose, Vertices]]:
    """Settles the mean shape in slightly changed poses, to measure how steady the ground truth is.

    Args:
        folder: The dataset, made if missing and continued.
        garment: The garment.
        poses: The poses.
        turn: Angle by which every joint is rotated about a random axis [rad].
        seed: Seed of the axes.
        jobs: Number of processes.

    Yields:
        The index of each pose, the changed pose, and the garment settled in it [m].
    """
    random = np.random.default_rng(seed)
    changed = []
    for pose in poses:
        axes = random.normal(size=(len(pose.rotations), 3))
        turns = from_axis_angle(turn * axes / np.linalg.norm(axes, axis=1, keepdims=True))
        changed.append(Pose(multiply(pose.rotations.astype(np.float64), turns).astype(np.float32), pose.translation))
    for number, vertices in enumerate(settle_in_poses(folder, garment, changed, jobs=jobs)):
        if vertices is not None:
            yield number, changed[number], vertices


def settle_as_played(
    folder: Path, garment: Garment, *, count: int, random: bool, seed: int, jobs: int
) -> Iterator[Worn]:
    """Yields garments in poses of the clips, arms where they are and limbs lifted out of each other as in `animate`.

    What the folder already holds is not simulated again. Poses in which it does not come to rest are left out.

    Args:
        folder: The dataset, made if missing and continued.
        garment: The garment.
        count: Number of poses of each clip.
        random: Whether the bodies are the random ones of `choose_pairs`, in turn, or the mean one.
        seed: Seed of the choice of poses and of the bodies.
        jobs: Number of processes.
    """
    body = bodies.load(garment.body_name)
    shapes = random_shapes(body, SHAPES, seed) if random else [()]
    place, draw = body.shaped().rest_pose.translation, np.random.default_rng(seed)
    by_shape: dict[tuple[float, ...], list[tuple[str, Pose]]] = {}
    for name in CLIPS:
        clip = motions.load(name).resample(SAMPLED_FPS)[::SAMPLE_STRIDE]
        for frame in draw.permutation(len(clip))[:count]:
            betas = shapes[sum(map(len, by_shape.values())) % len(shapes)]
            pose = body.shaped(betas).untangle(clip[int(frame)])
            rotations = without_heading(pose.rotations[None].astype(np.float64))[0].astype(np.float32)
            by_shape.setdefault(betas, []).append((name, Pose(rotations, place)))
    for betas, chosen in by_shape.items():
        poses = [[pose] for _, pose in chosen]
        results = produce_posed(folder, garment, poses, [betas], rules=HANGING, jobs=jobs)
        dataset = open_dataset(folder)
        for (name, pose), result in zip(chosen, results, strict=True):
            if result is not None:
                take = dataset.take(result.names[0])
                yield Worn(name, pose, betas, take.vertices[0], int(take.pinched[0]))


def settle_pairs(folder: Path, garment: Garment, *, count: int, seed: int, jobs: int) -> Iterator[Pair]:
    """Yields all pairs in which the garment came to rest; what the folder already holds is not simulated again."""
    by_shape: dict[tuple[float, ...], list[Pose]] = {}
    for pose, betas in choose_pairs(count, seed, garment.body_name):
        by_shape.setdefault(betas, []).append(pose)
    failures = 0
    for number, (betas, poses) in enumerate(by_shape.items()):
        results = produce_posed(folder, garment, [[pose] for pose in poses], [(), betas], jobs=jobs)
        dataset = open_dataset(folder)
        for pose, result in zip(poses, results, strict=True):
            if result is None or len(result.names) < 2:
                failures += 1
                continue
            mean, worn = (dataset.take(name).vertices[0] for name in result.names)
            yield Pair(pose, betas, mean, worn)
        progress = f"{number + 1} of {len(by_shape)} bodies, {failures} pairs without rest"
        print(progress, file=sys.stderr, flush=True)
