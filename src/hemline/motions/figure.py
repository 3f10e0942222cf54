"""A plain figure of 24 joints, where a clip comes without a skeleton: to tell up from down, and to draw."""

import numpy as np
from jaxtyping import Float

from .motion import JOINT_NAMES, PARENTS
from .quaternions import Quaternion, multiply, rotate

_SIDE = {
    "hip": (0.11, -0.01, -0.01),
    "knee": (0.11, -0.40, 0.02),
    "ankle": (0.12, -0.83, -0.01),
    "foot": (0.12, -0.90, 0.12),
    "collar": (0.02, 0.47, 0.01),
    "shoulder": (0.18, 0.48, 0.01),
    "elbow": (0.44, 0.48, 0.01),
    "wrist": (0.67, 0.48, 0.01),
    "hand": (0.77, 0.48, 0.01),
}
_MIDDLE = {
    "pelvis": (0, 0, 0),
    "spine1": (0, 0.08, -0.04),
    "spine2": (0, 0.15, -0.02),
    "spine3": (0, 0.23, -0.03),
    "neck": (0, 0.54, 0),
    "head": (0, 0.64, 0.03),
}
_PLACES = (
    _MIDDLE
    | {f"left_{name}": place for name, place in _SIDE.items()}
    | {f"right_{name}": (-place[0], *place[1:]) for name, place in _SIDE.items()}
)
FIGURE = np.array([_PLACES[name] for name in JOINT_NAMES], dtype=np.float64)
"""Joints of a person of middle height in the T-pose, the pelvis at the origin: those of anny24, rounded [m]."""

LEG = 0.82
"""Length from hip to knee to ankle of that figure [m]."""


def pose_figure(
    rotations: Float[np.ndarray, "frames joints 4"], translations: Float[np.ndarray, "frames 3"], leg_length: float
) -> Float[np.ndarray, "frames joints 3"]:
    """Returns the joints of the figure in each frame [m].

    Args:
        rotations: Local rotations, as those of a `Motion`.
        translations: Position of the pelvis [m].
        leg_length: Leg of the body that they are for, to which the figure is scaled [m].
    """
    places = np.empty((len(rotations), len(JOINT_NAMES), 3))
    turned: list[Quaternion] = []
    scaled = FIGURE * (leg_length / LEG)
    for joint, parent in enumerate(PARENTS):
        local = np.asarray(rotations[:, joint], dtype=np.float64)
        if parent < 0:
            turned.append(local)
            places[:, joint] = translations
        else:
            turned.append(multiply(turned[parent], local))
            places[:, joint] = places[:, parent] + rotate(turned[parent], scaled[joint] - scaled[parent])
    return places
