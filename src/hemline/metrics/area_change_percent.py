"""Change of the area of a garment."""

import numpy as np

from hemline.arrays import Faces, Float, Vertices
from hemline.meshes import face_areas


def area_change_percent(vertices: Vertices, faces: Faces, rest_edges: Float[np.ndarray, "faces 2 2"]) -> float:
    """Returns the change of the garment's total area in one frame from its flat rest shape.

    Args:
        vertices: The garment [m].
        faces: Triangles of the garment.
        rest_edges: The two edges of each flat rest triangle, as columns [m].

    Returns:
        The change [percent]; `mean_and_worst` summarises a clip.
    """
    rest = 0.5 * np.abs(np.linalg.det(rest_edges)).sum()
    return float(100 * (face_areas(np.asarray(vertices, np.float64), faces).sum() / rest - 1))
