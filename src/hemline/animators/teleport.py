"""Tells a body that was teleported, as in a game, from one that moved."""

import numpy as np

from hemline.motions.motion import Pose
from hemline.motions.quaternions import angle, inverse, multiply

TELEPORT_DISTANCE = 1.0
"""A pelvis that moves farther than this in one frame was teleported [m]."""
TELEPORT_SPEED = 15.0
"""In frames so long that the distance allows less, a pelvis that moves faster than this was teleported [m/s]."""
TELEPORT_ANGLE = np.radians(100)
"""A pelvis that turns farther than this in a frame of less than 0.1 s was teleported [rad]."""


def is_teleport(first: Pose, second: Pose, seconds: float) -> bool:
    """Returns whether a body was teleported from one pose to the next.

    Args:
        first: The pose before.
        second: The pose after.
        seconds: Time between them [s].
    """
    distance = float(np.linalg.norm(second.translation.astype(np.float64) - first.translation))
    one, two = (each.rotations[0].astype(np.float64) for each in (first, second))
    turn = float(angle(multiply(inverse(one), two)))
    return distance > max(TELEPORT_DISTANCE, TELEPORT_SPEED * seconds) or (turn > TELEPORT_ANGLE and seconds < 0.1)
