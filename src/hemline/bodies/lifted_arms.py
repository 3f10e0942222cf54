"""Arms lifted off the torso: an armpit leaves cloth no free place while the arm hangs."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from hemline.arrays import Quaternions
from hemline.motions.motion import JOINT_NAMES, Pose

from .lifted_arms_kernels import lift_arms

LIFT_DEG = 20.0
"""How far an arm that hangs is lifted."""

HANGING_DEG, RAISED_DEG = 30.0, 75.0
"""Angles between upper arm and the downward axis of its collar joint: up to the first an arm is lifted whole, from the
second on not at all."""

_ARMS = [JOINT_NAMES.index(name) for name in ("left_shoulder", "right_shoulder")]
_SIDES = np.array([1.0, -1.0])
_ANGLES = tuple(np.deg2rad([LIFT_DEG, HANGING_DEG, RAISED_DEG]).tolist())


def lifted_arms(pose: Pose) -> Pose:
    """The pose with each upper arm turned sideways and up by `LIFT_DEG`, less where it is raised already.

    It depends on the pose alone, smoothly, so that poses that are near to each other stay so, and two poses with arms
    at different heights keep their order. Garments are settled in lifted poses; skinning hands the arms back.

    Args:
        pose: The pose.
    """
    return replace(pose, rotations=lifted_rotations(pose.rotations), clip=None)


def lifted_rotations(rotations: Quaternions) -> Quaternions:
    """The rotations of a pose, lifted as `lifted_arms` does."""
    turned, lifted = rotations.astype(np.float64), np.empty((len(_ARMS), 4))
    lift_arms(turned[_ARMS], _SIDES, *_ANGLES, lifted)
    turned[_ARMS] = lifted
    return turned


def lift_deg(angle_deg: Float[np.ndarray, " arms"]) -> Float[np.ndarray, " arms"]:
    """How far upper arms are lifted that are so far from hanging straight down [deg]."""
    share = np.clip((angle_deg - HANGING_DEG) / (RAISED_DEG - HANGING_DEG), 0.0, 1.0)
    return LIFT_DEG * (1 - share * share * (3 - 2 * share))
