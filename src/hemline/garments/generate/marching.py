"""Marching tetrahedra: the surface where a field on a grid is zero."""

from itertools import permutations

import numpy as np

from hemline.arrays import Faces, Float, Vertices

_CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])


def _tetrahedra() -> np.ndarray:
    """Returns six tetrahedra of one handedness around the diagonal of a cube with corners numbered 4 x + 2 y + z."""
    result = []
    for order in permutations((4, 2, 1)):
        tet = [0, order[0], order[0] + order[1], 7]
        a, b, c, d = (_CORNERS[each] for each in tet)
        if np.linalg.det(np.stack([b - a, c - a, d - a])) < 0:
            tet[1], tet[2] = tet[2], tet[1]
        result.append(tet)
    return np.array(result)


_TETS = _tetrahedra()
_CASES = {
    # corners inside -> triangles of edges (pairs of corners), counter-clockwise seen from where the field is positive
    1: ((0, 1), (0, 2), (0, 3)),
    2: ((1, 0), (1, 3), (1, 2)),
    4: ((2, 0), (2, 1), (2, 3)),
    8: ((3, 0), (3, 2), (3, 1)),
}


def zero_surface(
    field: Float[np.ndarray, "nx ny nz"], origin: Float[np.ndarray, "3"], spacing: float
) -> tuple[Vertices, Faces]:
    """Triangulates the surface where a field is zero, by marching tetrahedra.

    Args:
        field: Values at the nodes of a grid, negative inside.
        origin: Position of the first node [m].
        spacing: Distance of neighbouring nodes [m].

    Returns:
        Positions, float64 [m], and triangles, counter-clockwise seen from where the field is positive. On the faces of
        the grid the surface ends in open rims that lie in them exactly.

    Source: Doi, Koide, "An Efficient Method of Triangulating Equi-Valued Surfaces by Using Tetrahedral Cells", 1991.
    """
    field = np.where(np.abs(field) < 1e-9, 1e-9, np.asarray(field, np.float64))
    strides = np.array([field.shape[1] * field.shape[2], field.shape[2], 1])
    inside = field < 0
    count = sum(inside[tuple(slice(c, c - 1 or None) for c in corner)].astype(np.int8) for corner in _CORNERS)
    cells = np.argwhere((count > 0) & (count < 8))
    nodes = (cells @ strides)[:, None] + _CORNERS @ strides
    tets = nodes[:, _TETS].reshape(-1, 4)
    flat = field.reshape(-1)
    case = (flat[tets] < 0) @ np.array([1, 2, 4, 8])
    ends = np.concatenate([_edges_of(tets, case, pattern) for pattern in range(1, 15)])
    ends = np.sort(ends, axis=2)
    keys = ends[..., 0] * flat.size + ends[..., 1]
    unique, faces = np.unique(keys, return_inverse=True)
    start, end = np.divmod(unique, flat.size)
    fraction = (flat[start] / (flat[start] - flat[end]))[:, None]
    first, last = (np.stack(np.unravel_index(each, field.shape), axis=1) for each in (start, end))
    return origin + spacing * (first + fraction * (last - first)), faces.reshape(-1, 3).astype(np.int32)


def _edges_of(tets: np.ndarray, case: np.ndarray, pattern: int) -> np.ndarray:
    """Returns the edges whose crossings are the corners of the triangles of one case (triangles, 3, 2)."""
    here = tets[case == pattern]
    within = [corner for corner in range(4) if pattern >> corner & 1]
    if len(within) == 1:
        triangles = [_CASES[pattern]]
    elif len(within) == 3:
        triangles = [_CASES[15 - pattern][::-1]]
    else:
        a, b = within
        c, d = (corner for corner in range(4) if corner not in within)
        if np.linalg.det(np.eye(4)[[a, b, c, d]]) < 0:
            c, d = d, c
        triangles = [((a, c), (a, d), (b, d)), ((a, c), (b, d), (b, c))]
    return np.concatenate([here[:, np.array(triangle)] for triangle in triangles])
