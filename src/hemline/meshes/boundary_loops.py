"""Open rims of a triangle mesh."""

import numpy as np

from hemline.arrays import Faces, Int

from .edges import directed_edges


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
    for start, end in _rim_edges(faces):
        following.setdefault(int(end), []).append(int(start))
    loops = []
    while following:
        loops += _loops_from(next(iter(following)), following)
    return tuple(np.array(loop, np.int32) for loop in sorted(loops, key=lambda loop: (-len(loop), loop[0])))


def _rim_edges(faces: Faces) -> np.ndarray:
    directed = directed_edges(faces)
    _, index, count = np.unique(np.sort(directed, axis=1), axis=0, return_index=True, return_counts=True)
    return directed[np.sort(index[count == 1])]


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
