"""How much of a garment hangs freely, as it lies on the body."""

import numpy as np

from hemline.arrays import Faces, Vertices
from hemline.bodies import ShapedBody
from hemline.meshes import ClosestTree, face_areas

HANGING_DISTANCE = 0.05
"""Distance from the skin beyond which cloth hangs [m]."""
LITTLE_HANGS, MOSTLY_HANGS = 20.0, 50.0
"""Percentages of the cloth of a garment: below the first little of it hangs, above the second most of it."""


def hanging_percent(vertices: Vertices, faces: Faces, shaped: ShapedBody) -> float:
    """Returns the percentage of a garment's area that is too far from the skin to move with it.

    T-shirts and trousers have none, an open jacket or a hoodie has 15 %, a dress of a narrow skirt 20 %, a poncho 50 %,
    a cape or a wide skirt 90 %. Animators that blend settled garments suit the first, rope chains the last: played by
    ropes, sleeves come off the arms in poses unlike those of the fit.

    Args:
        vertices: The garment on the body at rest [m].
        faces: Triangles.
        shaped: The body.
    """
    areas = face_areas(vertices, faces)
    middles = np.asarray(vertices, np.float64)[faces].mean(axis=1)
    closest = ClosestTree(shaped.vertices.astype(np.float64), shaped.body.faces).closest(middles)
    return float(100 * areas[closest.distances > HANGING_DISTANCE].sum() / areas.sum())
