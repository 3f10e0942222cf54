"""Lifts arms off the torso: the armpit of a hanging arm leaves no room for cloth."""

from dataclasses import replace

import numpy as np

from hemline.arrays import Quaternions
from hemline.motions.motion import JOINT_NAMES, Pose

from .lifted_arms_kernels import lift_arms

LIFT_DEG = 20.0
"""Angle by which a hanging arm is lifted [deg]."""

HANGING_DEG, RAISED_DEG = 30.0, 75.0
"""Angles between the upper arm and the downward axis of its collar joint [deg]: below the first an arm is lifted fully,
above the second not at all."""

_ARMS = [JOINT_NAMES.index(name) for name in ("left_shoulder", "right_shoulder")]
_SIDES = np.array([1.0, -1.0])
_ANGLES = tuple(np.deg2rad([LIFT_DEG, HANGING_DEG, RAISED_DEG]).tolist())


def lift_pose_arms(pose: Pose) -> Pose:
    """Returns a pose with each upper arm turned sideways and up by `LIFT_DEG`, or less if it is raised already.

    The lift is a smooth function of the pose: similar poses stay similar, and arms at different heights keep their
    order. Garments are settled in lifted poses; skinning moves the arms back.

    Args:
        pose: The pose.
    """
    return replace(pose, rotations=lift_rotations(pose.rotations), clip=None)


def lift_rotations(rotations: Quaternions) -> Quaternions:
    """Returns the rotations of a pose, lifted as `lift_pose_arms` does."""
    turned, lifted = rotations.astype(np.float64), np.empty((len(_ARMS), 4))
    lift_arms(turned[_ARMS], _SIDES, *_ANGLES, lifted)
    turned[_ARMS] = lifted
    return turned
