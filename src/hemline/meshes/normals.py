"""Normals and areas of triangles, normals at vertices."""

import numpy as np

from hemline.arrays import Faces, Float, Normals, Vertices


def face_vectors(vertices: Vertices, faces: Faces) -> Float[np.ndarray, "faces 3"]:
    """Returns the cross product of two edges of each triangle: its normal, as long as twice its area [m^2]."""
    corner = vertices[faces]
    return np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])


def face_areas(vertices: Vertices, faces: Faces) -> Float[np.ndarray, " faces"]:
    """Returns the area of each triangle [m^2]."""
    return np.linalg.norm(face_vectors(vertices, faces), axis=1) / 2


def face_normals(vertices: Vertices, faces: Faces) -> Float[np.ndarray, "faces 3"]:
    """Returns the unit normal of each triangle, by the right-hand rule; zero if the triangle has no area."""
    return _unit(face_vectors(vertices, faces))


def vertex_normals(vertices: Vertices, faces: Faces) -> Normals:
    """Returns the unit normal at each vertex, the area-weighted mean over its triangles; zero if it has none."""
    vectors = face_vectors(vertices, faces)
    total = np.zeros_like(vertices)
    for corner in range(3):
        for axis in range(3):
            total[:, axis] += np.bincount(faces[:, corner], vectors[:, axis], len(vertices)).astype(vertices.dtype)
    return _unit(total)


def _unit(vectors: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(length > 0, length, 1)
