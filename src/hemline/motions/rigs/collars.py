"""Collars that go up and down with the arms, for recordings in which they stand still."""

import numpy as np

from hemline.motions.quaternions import (
    Quaternion,
    angle,
    continuous,
    from_axis_angle,
    inverse,
    multiply,
    normalised,
    rotate,
)

from .t_pose import LOWERED_DEG

_STILL_DEG = 3.0


def stand_still(local: Quaternion) -> bool:
    """Whether a joint hardly turns over a clip."""
    mean = normalised(continuous(local).mean(axis=0))
    return bool(np.degrees(angle(multiply(inverse(mean), local))).max() < _STILL_DEG)


def carried_by_arm(chest: Quaternion, shoulder: Quaternion, sign: float) -> Quaternion:
    r"""Global rotation of a collar from that of chest and upper arm.

    $$\theta = 12^\circ \, (\text{direction of the arm} \cdot \text{down})$$

    is how far it is lowered against the T-pose: 12 degrees below an arm that hangs, as in the rest pose of anny24,
    none below a level arm, and raised by 12 degrees below one that points up.

    Args:
        chest: Global rotation of spine3.
        shoulder: Global rotation of the upper arm.
        sign: 1 for the left side, -1 for the right.
    """
    arm = rotate(inverse(chest), rotate(shoulder, np.array([sign, 0.0, 0.0])))
    turn = np.zeros_like(arm)
    turn[..., 2] = sign * np.radians(LOWERED_DEG) * arm[..., 1]
    return multiply(chest, from_axis_angle(turn))
