"""Lifts arms off the torso: the armpit of a hanging arm leaves no room for cloth."""

from dataclasses import replace

import numpy as np

from hemline.arrays import Quaternions
from hemline.motions.motion import JOINT_NAMES, Pose

from .lifted_arms_kernels import lift_arms

LIFT_DEG = 12.0
"""Angle by which a hanging arm is lifted where a garment is settled [deg]."""

FORMER_LIFT_DEG = 20.0
"""Angle by which a hanging arm was lifted in drapes and models whose file does not name the angle [deg]."""

HANGING_DEG, RAISED_DEG = 30.0, 75.0
"""Angles between the upper arm and the downward axis of its collar joint [deg]: below the first an arm is lifted fully,
above the second not at all."""

_ARMS = [JOINT_NAMES.index(name) for name in ("left_shoulder", "right_shoulder")]
_SIDES = np.array([1.0, -1.0])
_FADES = tuple(np.deg2rad([HANGING_DEG, RAISED_DEG]).tolist())


def lift_pose_arms(pose: Pose, lift_deg: float = LIFT_DEG) -> Pose:
    """Returns a pose with each upper arm turned sideways and up, the less the more it is raised already.

    The lift is a smooth function of the pose: similar poses stay similar, and arms at different heights keep their
    order. Garments are settled in lifted poses; skinning moves the arms back.

    Args:
        pose: The pose.
        lift_deg: Angle by which an arm is turned that hangs [deg].
    """
    return replace(pose, rotations=lift_rotations(pose.rotations, lift_deg), clip=None)


def lift_rotations(rotations: Quaternions, lift_deg: float = LIFT_DEG) -> Quaternions:
    """Returns the rotations of a pose, lifted as `lift_pose_arms` does."""
    turned, lifted = rotations.astype(np.float64), np.empty((len(_ARMS), 4))
    lift_arms(turned[_ARMS], _SIDES, np.deg2rad(lift_deg), *_FADES, lifted)
    turned[_ARMS] = lifted
    return turned
