"""A mesh cut along the line where a function of its vertices is zero."""

import numpy as np

from hemline.arrays import Faces, Float, Vertices


def clip_mesh(vertices: Vertices, faces: Faces, values: Float[np.ndarray, " verts"]) -> tuple[Vertices, Faces]:
    """What is left of a mesh where a function is negative, cut exactly along its zero line.

    Args:
        vertices: Positions [m].
        faces: Triangles.
        values: The function at the vertices, linear within a triangle.

    Returns:
        Positions and triangles of what is left; vertices that no triangle uses are gone.
    """
    values = np.where(np.abs(values) < 1e-7, 1e-7, values)
    kept = values < 0
    count = kept[faces].sum(axis=1)
    turned = np.concatenate([_rotate_corners(faces[count == 1], kept, True), _rotate_corners(faces[count == 2], kept, False)])
    single = kept[turned[:, 0]]
    keys = np.sort(np.concatenate([turned[:, [0, 1]], turned[:, [0, 2]]]), axis=1)
    cut, index = np.unique(keys, axis=0, return_inverse=True)
    share = values[cut[:, 0]] / (values[cut[:, 0]] - values[cut[:, 1]])
    points = vertices[cut[:, 0]] + share[:, None] * (vertices[cut[:, 1]] - vertices[cut[:, 0]])
    first, second = len(vertices) + index.reshape(2, -1)
    new = [
        faces[count == 3],
        np.stack([turned[:, 0], first, second], axis=1)[single],
        np.stack([first, turned[:, 1], turned[:, 2]], axis=1)[~single],
        np.stack([first, turned[:, 2], second], axis=1)[~single],
    ]
    return drop_unused_vertices(np.concatenate([vertices, points]), np.concatenate(new).astype(np.int32))


def drop_unused_vertices(vertices: Vertices, faces: Faces) -> tuple[Vertices, Faces]:
    """A mesh without the vertices that no triangle uses."""
    used, numbers = np.unique(faces, return_inverse=True)
    return vertices[used], numbers.reshape(-1, 3).astype(np.int32)


def _rotate_corners(faces: Faces, kept: np.ndarray, alone: bool) -> Faces:
    """Triangles turned so that their odd corner is the first: the one kept corner, or the one that is not."""
    first = (kept[faces] == alone).argmax(axis=1)
    return np.take_along_axis(faces, (first[:, None] + np.arange(3)) % 3, axis=1)
