"""The flat triangles that cloth is cut from."""

import numpy as np

from hemline.arrays import Faces, Float, Int, Vertices


def rest_edges_of_mesh(vertices: Vertices, faces: Faces) -> Float[np.ndarray, "faces 2 2"]:
    """Each triangle of a mesh laid flat: its first edge along x, the second corner's side above.

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
    """Each triangle of a flat pattern; mirrored pieces are mirrored back, so that all areas are positive.

    Args:
        pattern: Flat positions [m].
        pattern_faces: For each corner its row in `pattern`.

    Returns:
        For each triangle a matrix whose columns are its edges from the first corner, float64 [m].
    """
    corner = np.asarray(pattern, np.float64)[pattern_faces]
    matrix = np.stack([corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]], axis=2)
    mirrored = np.linalg.det(matrix) < 0
    matrix[mirrored, 1] *= -1
    return matrix


def edge_lengths(rest_edges: Float[np.ndarray, "faces 2 2"]) -> Float[np.ndarray, "faces 3"]:
    """Lengths of the three edges of each flat triangle: 0-1, 1-2, 2-0 [m]."""
    first, second = rest_edges[:, :, 0], rest_edges[:, :, 1]
    return np.stack([np.linalg.norm(each, axis=1) for each in (first, second - first, second)], axis=1)


def edge_strain(
    vertices: Vertices, faces: Faces, rest_edges: Float[np.ndarray, "faces 2 2"]
) -> Float[np.ndarray, "faces 3"]:
    """Stretch of the three edges of each triangle against the pattern: l / l_rest - 1."""
    corner = np.asarray(vertices, np.float64)[faces]
    lengths = np.linalg.norm(corner[:, [1, 2, 0]] - corner, axis=2)
    return lengths / edge_lengths(rest_edges) - 1
