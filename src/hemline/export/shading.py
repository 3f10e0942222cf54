"""Vertex normals of exported meshes."""

import numpy as np

from hemline.arrays import Faces, Normals, Vertices
from hemline.meshes import vertex_normals


def unit_normals(vertices: Vertices, faces: Faces) -> Normals:
    """Returns unit normals at vertices; upward where a vertex has no triangles."""
    normals = vertex_normals(np.asarray(vertices, np.float32), faces)
    normals[~normals.any(axis=1)] = (0.0, 1.0, 0.0)
    return normals
