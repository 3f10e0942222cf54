"""Moves collars up and down with the arms, for recordings in which they stand still."""

import numpy as np

from hemline.motions.quaternions import (
    Quaternion,
    angle,
    continuous,
    from_axis_angle,
    inverse,
    multiply,
    normalise,
    rotate,
)

from .t_pose import LOWERED_DEG

_STILL_DEG = 3.0


def is_still(local: Quaternion) -> bool:
    """Whether a joint hardly turns over a clip."""
    mean = normalise(continuous(local).mean(axis=0))
    return bool(np.degrees(angle(multiply(inverse(mean), local))).max() < _STILL_DEG)


def collar_from_arm(chest: Quaternion, shoulder: Quaternion, sign: float) -> Quaternion:
    r"""Returns the global rotation of a collar from those of chest and upper arm.

    $$\theta = 12^\circ \, (\text{direction of the arm} \cdot \text{down})$$

    is the angle by which the collar is lowered from the T-pose: 12 degrees for a hanging arm, as in the rest pose of
    anny24, none for a level arm, and -12 degrees for an arm that points up.

    Args:
        chest: Global rotation of spine3.
        shoulder: Global rotation of the upper arm.
        sign: 1 for the left side, -1 for the right.
    """
    arm = rotate(inverse(chest), rotate(shoulder, np.array([sign, 0.0, 0.0])))
    turn = np.zeros_like(arm)
    turn[..., 2] = sign * np.radians(LOWERED_DEG) * arm[..., 1]
    return multiply(chest, from_axis_angle(turn))
