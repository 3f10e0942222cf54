"""Tells the rest pose of a character from a frame of a clip."""

import numpy as np

from hemline.motions.quaternions import Quaternion, Vector, inverse, rotate

from .rig import Rig

_UNEVEN_DEG = 10.0
"""Limbs of a rest pose mirror each other to within this angle."""
_LEANING_DEG = 35.0
"""Legs of a rest pose are within this angle of straight down."""


def is_rest_pose(rig: Rig, standing: Quaternion) -> bool:
    """Whether the zero pose of a rig is a T-pose or an A-pose: both sides alike, the legs beneath the hips.

    Args:
        rig: The rig.
        standing: The rotation of our axes to those of its zero pose.
    """
    upright = inverse(standing)
    for start, end, leg in (
        ("hip", "knee", True),
        ("knee", "ankle", True),
        ("shoulder", "elbow", False),
        ("elbow", "wrist", False),
    ):
        left, right = (
            _unit(rotate(upright, rig.bone(f"{side}_{start}", f"{side}_{end}"))) for side in ("left", "right")
        )
        if _apart_deg(left, right * [-1, 1, 1]) > _UNEVEN_DEG:
            return False
        if leg and _apart_deg(left, np.array([0.0, -1, 0])) > _LEANING_DEG:
            return False
    return True


def _unit(vector: Vector) -> Vector:
    return vector / max(float(np.linalg.norm(vector)), 1e-12)


def _apart_deg(first: Vector, second: Vector) -> float:
    return float(np.degrees(np.arccos(np.clip(first @ second, -1, 1))))
