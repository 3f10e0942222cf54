"""Tells whether the shoulders carry a garment, so that it needs no pins."""

from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Faces, Vertices
from hemline.meshes import boundary_loops
from hemline.motions.motion import JOINT_NAMES

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

SHOULDER_DISTANCE = 0.06
"""Cloth nearer than this to the middle of a shoulder rests on it [m]."""
SHORTEST_OPENING = 0.12
"""Length of the shortest rim that a head or an arm goes through [m]."""


def rests_on_shoulders(vertices: Vertices, shaped: "ShapedBody") -> bool:
    """Tells whether cloth lies on both shoulders, between neck and arm.

    Args:
        vertices: The cloth on the body at rest [m].
        shaped: The body.
    """
    for side in ("left", "right"):
        neck, shoulder = (shaped.joints[JOINT_NAMES.index(each)] for each in ("neck", f"{side}_shoulder"))
        middle = 0.3 * neck + 0.7 * shoulder
        above = shaped.vertices[np.linalg.norm(shaped.vertices[:, [0, 2]] - middle[[0, 2]], axis=1) < 0.03]
        top = np.array([middle[0], above[above[:, 1] < neck[1] + 0.1][:, 1].max(), middle[2]])
        if np.linalg.norm(vertices - top, axis=1).min() > SHOULDER_DISTANCE:
            return False
    return True


def carried_by_shoulders(vertices: Vertices, faces: Faces, shaped: "ShapedBody") -> bool:
    """Tells whether a garment stays on the shoulders by itself: it rests on them, and has openings for head or arms.

    A sheet with a single rim, such as a cape, rests on the shoulders as well, but slides off unless it is pinned.

    Args:
        vertices: The garment on the body at rest [m].
        faces: Triangles.
        shaped: The body.
    """
    openings = sum(
        float(np.linalg.norm(vertices[loop] - vertices[np.roll(loop, 1)], axis=1).sum()) >= SHORTEST_OPENING
        for loop in boundary_loops(faces)
    )
    return openings >= 2 and rests_on_shoulders(vertices, shaped)
