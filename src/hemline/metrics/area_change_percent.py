"""How much a garment has grown or shrunk."""

import numpy as np

from hemline.arrays import Faces, Float, Vertices
from hemline.meshes import face_areas


def area_change_percent(vertices: Vertices, faces: Faces, rest_edges: Float[np.ndarray, "faces 2 2"]) -> float:
    """Change of the garment's whole area in one frame from its flat rest shape.

    Args:
        vertices: The garment [m].
        faces: Its triangles.
        rest_edges: Columns: the two edges of each flat rest triangle [m].

    Returns:
        The change [percent]; `mean_and_worst` sums up a clip.
    """
    rest = 0.5 * np.abs(np.linalg.det(rest_edges)).sum()
    return float(100 * (face_areas(np.asarray(vertices, np.float64), faces).sum() / rest - 1))
