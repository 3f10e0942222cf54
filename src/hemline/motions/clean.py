"""The part of a clip that was captured without jumps."""

import numpy as np

from .motion import JOINT_NAMES, Motion
from .quaternions import angle, inverse, multiply

JUMP_DEG_S = 3000.0
"""A joint of the body that turns faster than this was lost by the cameras [deg/s]."""

_UNJUDGED = ("head", "collar", "foot", "wrist", "hand")
_JUDGED = [index for index, name in enumerate(JOINT_NAMES) if not name.endswith(_UNJUDGED)]
_COLLARS, _SHOULDERS = (
    [JOINT_NAMES.index(f"{side}_{name}") for side in ("left", "right")] for name in ("collar", "shoulder")
)


def longest_clean(motion: Motion) -> tuple[int, int]:
    """First frame of the longest stretch without a jump, and the one after its last: `motion[first:end]`.

    Judged are trunk and limbs, the upper arms against the chest; head, hands and toes are not, since they are noisy in
    most recordings.
    """
    rotations = motion.rotations.astype(np.float64)
    rotations[:, _SHOULDERS] = multiply(rotations[:, _COLLARS], rotations[:, _SHOULDERS])
    rotations = rotations[:, _JUDGED]
    speeds_deg_s = np.degrees(angle(multiply(inverse(rotations[:-1]), rotations[1:]))) * motion.fps
    jumps = np.flatnonzero((speeds_deg_s > JUMP_DEG_S).any(axis=1))
    borders = np.concatenate([[0], jumps + 1, [len(motion)]])
    longest = int(np.argmax(np.diff(borders)))
    return int(borders[longest]), int(borders[longest + 1])
