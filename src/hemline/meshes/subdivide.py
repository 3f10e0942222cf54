"""Cuts triangles in four at the middles of their edges."""

import numpy as np

from hemline.arrays import Faces, Int

from .edges import edges


def subdivide(faces: Faces, vertex_count: int) -> tuple[Int[np.ndarray, "finer 3"], Int[np.ndarray, "middles 2"]]:
    """Cuts every triangle in four.

    Triangle f = (a, b, c) with middles u of ab, v of bc, w of ca becomes, in this order, (a, u, w), (u, b, v),
    (w, v, c) and (u, v, w): the first three are f at half its size, the last is f rotated by half a turn.

    Args:
        faces: Triangles.
        vertex_count: Number of vertices; middles are numbered from there on.

    Returns:
        Four triangles for each, and for each new vertex the two vertices that it lies between.

    Example:
        >>> faces, ends = subdivide(np.array([[0, 1, 2]], np.int32), 3)
        >>> faces.tolist(), ends.tolist()
        ([[0, 3, 4], [3, 1, 5], [4, 5, 2], [3, 5, 4]], [[0, 1], [0, 2], [1, 2]])
    """
    ends = edges(faces)
    keys = ends[:, 0].astype(np.int64) * vertex_count + ends[:, 1]
    a, b, c = faces.T
    u, v, w = (
        vertex_count + np.searchsorted(keys, np.minimum(p, q).astype(np.int64) * vertex_count + np.maximum(p, q))
        for p, q in ((a, b), (b, c), (c, a))
    )
    four = [[a, u, w], [u, b, v], [w, v, c], [u, v, w]]
    return np.stack([np.stack(each, axis=1) for each in four], axis=1).reshape(-1, 3).astype(np.int32), ends
