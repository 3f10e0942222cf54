"""Poses that the tests of the body room share."""

import numpy as np

from hemline.bodies import ShapedBody, overlapping
from hemline.motions import JOINT_NAMES, Motion, Pose
from hemline.motions.quaternions import from_axis_angle

JOINTS = len(JOINT_NAMES)


def t_pose() -> Pose:
    return Pose(np.tile(np.array([1, 0, 0, 0], np.float32), (JOINTS, 1)), np.zeros(3, np.float32))


def overlap_percent(shaped: ShapedBody, motion: Motion) -> np.ndarray:
    """Percentage of the body's vertices that lie inside another part of it, in each frame [%]."""
    return np.array([100 * overlapping(shaped.posed(motion[frame])).mean() for frame in range(len(motion))])


def random_pose(seed: int, scale: float = 0.35) -> Pose:
    """Every joint turned at random, by `scale` radians or so, the pelvis somewhere within a metre or so."""
    rng = np.random.default_rng(seed)
    return Pose(from_axis_angle(rng.normal(scale=scale, size=(JOINTS, 3))), rng.normal(size=3))


def turned(pose: Pose, **turns: tuple[float, float, float]) -> Pose:
    """A pose with the local rotation of some joints replaced by a rotation vector [rad]."""
    rotations = pose.rotations.copy()
    for name, turn in turns.items():
        rotations[JOINT_NAMES.index(name)] = from_axis_angle(np.array(turn))
    return Pose(rotations, pose.translation)


def arms_down(lift: float = 0.0) -> Pose:
    """Standing with straight arms along the sides; they run into the torso unless lifted [rad]."""
    down = np.pi / 2 - lift
    return turned(t_pose(), left_shoulder=(0, 0, -down), right_shoulder=(0, 0, down))


def clip_of(poses: list[Pose], fps: float = 30.0, leg_length: float = 0.8) -> Motion:
    rotations, translations = np.stack([p.rotations for p in poses]), np.stack([p.translation for p in poses])
    return Motion(rotations, translations, fps=fps, leg_length=leg_length, name="made")
