"""The size of a body that is far from usual, such as a child's, for garments that are to fit it."""

import numpy as np

from hemline.motions import JOINT_NAMES

from .shape import BodyShape

USUAL_TRUNK = 0.54
"""Distance from the pelvis to the neck of the usual body, for which most garments are made [m]."""

OTHER_SIZE = 1.3
"""Ratio to the usual size, or its inverse, up to which a body counts as of usual size."""

_PELVIS, _NECK = JOINT_NAMES.index("pelvis"), JOINT_NAMES.index("neck")


def own_size(shaped: BodyShape) -> float:
    """Returns the ratio of a body's size to the usual one, by its trunk; 1 if it is nearly that.

    Args:
        shaped: The body.
    """
    trunk = float(np.linalg.norm(shaped.joints[_NECK].astype(np.float64) - shaped.joints[_PELVIS]))
    size = trunk / USUAL_TRUNK
    return size if max(size, 1 / size) > OTHER_SIZE else 1.0
