"""Flat rest triangles of cloth."""

import numpy as np

from hemline.arrays import Faces, Float, Int, Vertices


def rest_edges_of_mesh(vertices: Vertices, faces: Faces) -> Float[np.ndarray, "faces 2 2"]:
    """Flattens each triangle of a mesh: its first edge points along x, its third corner has y > 0.

    Args:
        vertices: Positions [m].
        faces: Triangles.

    Returns:
        For each triangle a matrix whose columns are its edges from the first corner, float64 [m].
    """
    corner = np.asarray(vertices, np.float64)[faces]
    first, second = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    length = np.linalg.norm(first, axis=1)
    along = (first * second).sum(axis=1) / length
    across = np.linalg.norm(np.cross(first, second), axis=1) / length
    return np.stack([np.stack([length, along], 1), np.stack([np.zeros_like(length), across], 1)], axis=1)


def rest_edges_of_pattern(
    pattern: Float[np.ndarray, "pattern_verts 2"], pattern_faces: Int[np.ndarray, "faces 3"]
) -> Float[np.ndarray, "faces 2 2"]:
    """Returns each triangle of a flat pattern; mirrored pieces are mirrored back, so that all areas are positive.

    Args:
        pattern: Flat positions [m].
        pattern_faces: Row in `pattern` of each corner.

    Returns:
        For each triangle a matrix whose columns are its edges from the first corner, float64 [m].
    """
    corner = np.asarray(pattern, np.float64)[pattern_faces]
    matrix = np.stack([corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]], axis=2)
    mirrored = np.linalg.det(matrix) < 0
    matrix[mirrored, 1] *= -1
    return matrix
