"""Clips a mesh along the line where a function of its vertices is zero."""

import numpy as np

from hemline.arrays import Faces, Float, Vertices


def clip_mesh(vertices: Vertices, faces: Faces, values: Float[np.ndarray, " verts"]) -> tuple[Vertices, Faces]:
    """Clips a mesh to where a function is negative, exactly along its zero line.

    Args:
        vertices: Positions [m].
        faces: Triangles.
        values: The function at the vertices, linear within a triangle.

    Returns:
        Positions and triangles of the clipped mesh, without vertices that no triangle uses.
    """
    values = np.where(np.abs(values) < 1e-7, 1e-7, values)
    inside = values < 0
    count = inside[faces].sum(axis=1)
    rotated = np.concatenate(
        [_rotate_corners(faces[count == 1], inside, True), _rotate_corners(faces[count == 2], inside, False)]
    )
    single = inside[rotated[:, 0]]
    keys = np.sort(np.concatenate([rotated[:, [0, 1]], rotated[:, [0, 2]]]), axis=1)
    cut, index = np.unique(keys, axis=0, return_inverse=True)
    fraction = values[cut[:, 0]] / (values[cut[:, 0]] - values[cut[:, 1]])
    points = vertices[cut[:, 0]] + fraction[:, None] * (vertices[cut[:, 1]] - vertices[cut[:, 0]])
    first, second = len(vertices) + index.reshape(2, -1)
    new = [
        faces[count == 3],
        np.stack([rotated[:, 0], first, second], axis=1)[single],
        np.stack([first, rotated[:, 1], rotated[:, 2]], axis=1)[~single],
        np.stack([first, rotated[:, 2], second], axis=1)[~single],
    ]
    return drop_unused_vertices(np.concatenate([vertices, points]), np.concatenate(new).astype(np.int32))


def drop_unused_vertices(vertices: Vertices, faces: Faces) -> tuple[Vertices, Faces]:
    """Drops the vertices of a mesh that no triangle uses."""
    used, numbers = np.unique(faces, return_inverse=True)
    return vertices[used], numbers.reshape(-1, 3).astype(np.int32)


def _rotate_corners(faces: Faces, inside: np.ndarray, alone: bool) -> Faces:
    """Rotates the corners of triangles so that the first one is alone inside, or alone outside."""
    first = (inside[faces] == alone).argmax(axis=1)
    return np.take_along_axis(faces, (first[:, None] + np.arange(3)) % 3, axis=1)
