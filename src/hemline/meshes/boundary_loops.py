"""Open rims of a triangle mesh."""

import numpy as np

from hemline.arrays import Faces, Int

from .edges import directed_edges, rim_edges

_SEAM_SHARE = 0.15
"""Fraction of the vertices of a loop that lie inside another sheet if the loop is a seam."""


def boundary_loops(faces: Faces) -> tuple[Int[np.ndarray, " loop"], ...]:
    """Returns the vertices of each open rim in order, the longest rim first.

    A rim runs against the direction of its triangles: seen from outside, the hole is on its left. Winding must
    be consistent and each rim vertex must lie on one rim only; a rim that touches itself is split there.

    Args:
        faces: Triangles.

    Returns:
        One array of vertex ids for each rim, int32; an empty tuple for a closed mesh.

    Example:
        >>> [loop.tolist() for loop in boundary_loops(np.array([[0, 1, 2]]))]
        [[0, 2, 1]]
    """
    following: dict[int, list[int]] = {}
    for start, end in rim_edges(faces):
        following.setdefault(int(end), []).append(int(start))
    loops = []
    while following:
        loops += _loops_from(next(iter(following)), following)
    return tuple(np.array(loop, np.int32) for loop in sorted(loops, key=lambda loop: (-len(loop), loop[0])))


def open_rims(faces: Faces) -> tuple[Int[np.ndarray, " loop"], ...]:
    """Returns the boundary loops that are no seams: those of a pocket, sewn on at single vertices, are left out.

    A loop is a seam if at least two of its vertices, and 15 % of them, lie inside another sheet.

    Args:
        faces: Triangles.
    """
    loops = boundary_loops(faces)
    if not loops:
        return loops
    inside = np.zeros(int(faces.max()) + 1, bool)
    inside[_vertices_inside(faces)] = True
    return tuple(loop for loop in loops if inside[loop].sum() < max(2, _SEAM_SHARE * len(loop)))


def _vertices_inside(faces: Faces) -> np.ndarray:
    """Returns the vertices that have a closed fan of triangles around them."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    count = len(faces)
    directed = directed_edges(faces).astype(np.int64)
    low, high = np.sort(directed, axis=1).T
    order = np.lexsort((high, low))
    same = (low[order][1:] == low[order][:-1]) & (high[order][1:] == high[order][:-1])
    one, other = order[:-1][same], order[1:][same]
    # corners are numbered as `directed_edges` numbers the edges that begin there
    links = [[_corner_at(directed, row, vertex, count) for row in (one, other)] for vertex in (low[one], high[one])]
    left, right = (np.concatenate(each) for each in zip(*links, strict=True))
    graph = coo_matrix((np.ones(len(left), bool), (left, right)), (3 * count, 3 * count))
    fan = connected_components(graph, directed=False)[1]
    corners, joints = np.bincount(fan), np.bincount(fan[left], minlength=int(fan.max()) + 1)
    return np.unique(directed[:, 0][(corners == joints)[fan]])


def _corner_at(directed: np.ndarray, edge: np.ndarray, vertex: np.ndarray, count: int) -> np.ndarray:
    """Returns the corner of a triangle at one end of an edge of it."""
    return np.where(directed[edge, 0] == vertex, edge, (edge + count) % (3 * count))


def _loops_from(start: int, following: dict[int, list[int]]) -> list[list[int]]:
    """Walks from `start` until the walk ends, cutting off a loop each time it meets itself."""
    path, loops, at = [start], [], {start: 0}
    while path and following.get(path[-1]):
        vertex = path[-1]
        after = following[vertex].pop()
        if not following[vertex]:
            del following[vertex]
        if after in at:
            loop = path[at[after] :]
            loops.append(loop)
            del path[at[after] + 1 :]
            for each in loop[1:]:
                del at[each]
        else:
            at[after] = len(path)
            path.append(after)
    return [loop[loop.index(min(loop)) :] + loop[: loop.index(min(loop))] for loop in loops]
