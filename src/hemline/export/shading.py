"""Normals as formats want them."""

import numpy as np

from hemline.arrays import Faces, Normals, Vertices
from hemline.meshes import vertex_normals


def unit_normals(vertices: Vertices, faces: Faces) -> Normals:
    """Normals at vertices, each of unit length; upward where a vertex has no triangles."""
    normals = vertex_normals(np.asarray(vertices, np.float32), faces)
    normals[~normals.any(axis=1)] = (0.0, 1.0, 0.0)
    return normals
