"""Cuts the polygons of a mesh file into triangles."""

import numpy as np

from hemline.arrays import Float, Int
from hemline.errors import BadMesh

from .ear_kernels import clip_ears

CORNERS_MAX = 4096
"""Largest number of corners of a polygon: the work to cut it grows with their square."""

_FLAT = 1e-6
"""A triangle of a polygon needs this area, as a fraction of the square of its longest side."""


def cut_polygons(
    vertices: Float[np.ndarray, "verts 3"], corners: Int[np.ndarray, " corners"], sizes: Int[np.ndarray, " polygons"]
) -> Int[np.ndarray, "faces 3"]:
    """Cuts polygons into triangles, without an overlap, a triangle without area or a third triangle at an edge.

    Convex polygons become a fan about their first corner, as long as that makes no edge that another polygon has;
    all others are cut in their plane by clipping ears.

    Args:
        vertices: Positions.
        corners: Vertex of each corner, polygon by polygon.
        sizes: Number of corners of each polygon, 3 or more.

    Returns:
        Three rows of `corners` for each triangle, in the order of the polygons.

    Raises:
        BadMesh: A polygon has more than `CORNERS_MAX` corners.
    """
    if sizes.max(initial=0) > CORNERS_MAX:
        what = f"a polygon may have {CORNERS_MAX} corners"
        raise BadMesh(what, int(sizes.max()), "cut it into triangles, and export the mesh again")
    first = np.concatenate([[0], np.cumsum(sizes)])
    if not (sizes > 3).any():
        return _fans(first[:-1], sizes)
    with np.errstate(all="ignore"):  # positions may be infinite, which is refused later
        return _cut(vertices[corners], corners, first, sizes)


def _cut(points: np.ndarray, corners: np.ndarray, first: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Returns fans of sound polygons, and triangles clipped off all others."""
    normals = _normals(points, first, sizes)
    triangles = _fans(first[:-1], sizes)
    owner = np.repeat(np.arange(len(sizes)), sizes - 2)
    _choose_diagonals(triangles, corners, points, normals, first, sizes)
    bad = (sizes[owner] > 3) & ~_are_sound(triangles, points, normals[owner])
    odd = np.unique(owner[bad | _touch_elsewhere(triangles, owner, corners, first, sizes)])
    if len(odd):
        rows = np.concatenate([np.arange(first[each], first[each + 1]) for each in odd])
        starts = np.concatenate([[0], np.cumsum(sizes[odd])])
        clipped = np.empty((int((sizes[odd] - 2).sum()), 3), np.int64)
        clip_ears(_in_plane(points[rows], np.repeat(normals[odd], sizes[odd], axis=0)), starts, clipped)
        triangles[np.isin(owner, odd)] = rows[clipped]
    return triangles


def _fans(first: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Returns fans of triangles about the first corner of each polygon."""
    count = sizes - 2
    start = np.repeat(first, count)
    step = np.arange(len(start)) - np.repeat(np.cumsum(count) - count, count)
    return np.stack([start, start + step + 1, start + step + 2], axis=1)


def _choose_diagonals(
    triangles: np.ndarray,
    corners: np.ndarray,
    points: np.ndarray,
    normals: np.ndarray,
    first: np.ndarray,
    sizes: np.ndarray,
) -> None:
    """Turns the diagonal of quads where it would make a bad triangle, or an edge that another polygon has."""
    quads = np.flatnonzero(sizes == 4)
    start = first[quads]
    before = _keys(corners[start], corners[start + 2])
    outlines = _outlines(corners, first)
    _, once = np.unique(before, return_index=True)
    shared = np.isin(before, outlines)
    shared[np.setdiff1d(np.arange(len(before)), once)] = True
    sound = np.ones(len(quads), bool)
    other = np.ones(len(quads), bool)
    for a, b, c in ((0, 1, 2), (0, 2, 3)):
        sound &= _are_sound(np.stack([start + a, start + b, start + c], axis=1), points, normals[quads])
    for a, b, c in ((1, 2, 3), (1, 3, 0)):
        other &= _are_sound(np.stack([start + a, start + b, start + c], axis=1), points, normals[quads])
    free = ~np.isin(_keys(corners[start + 1], corners[start + 3]), outlines)
    turned = other & ((shared & free) | ~sound)
    row = (np.cumsum(sizes - 2) - (sizes - 2))[quads[turned]]
    start = start[turned]
    triangles[row] = np.stack([start + 1, start + 2, start + 3], axis=1)
    triangles[row + 1] = np.stack([start + 1, start + 3, start], axis=1)


def _are_sound(triangles: np.ndarray, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Returns which triangles have an area, and face the same way as their polygon."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    with np.errstate(all="ignore"):
        longest = np.max([((one - other) ** 2).sum(axis=1) for one, other in ((a, b), (b, c), (c, a))], axis=0)
        return (np.cross(b - a, c - a) * normals).sum(axis=1) > _FLAT * longest


def _touch_elsewhere(
    triangles: np.ndarray, owner: np.ndarray, corners: np.ndarray, first: np.ndarray, sizes: np.ndarray
) -> np.ndarray:
    """Returns which triangles of polygons of five or more corners have a diagonal that is an edge of a polygon, too."""
    large = np.flatnonzero(sizes[owner] > 4)
    result = np.zeros(len(triangles), bool)
    if not len(large):
        return result
    outlines = _outlines(corners, first)
    local = triangles[large] - first[owner[large]][:, None]
    for one, other in ((0, 1), (1, 2), (2, 0)):
        apart = np.abs(local[:, one] - local[:, other])
        diagonal = (apart != 1) & (apart != sizes[owner[large]] - 1)
        keys = _keys(corners[triangles[large, one]], corners[triangles[large, other]])
        result[large] |= diagonal & np.isin(keys, outlines)
    return result


def _keys(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Returns a number for each undirected edge."""
    return np.minimum(one, other).astype(np.int64) * 2**31 + np.maximum(one, other)


def _outlines(corners: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Returns the edges of all polygons, as numbers."""
    following = np.arange(1, len(corners) + 1)
    following[first[1:] - 1] = first[:-1]
    return np.unique(_keys(corners, corners[following]))


def _normals(points: np.ndarray, first: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Returns the unit normal of each polygon (Newell's method); zero for one without area."""
    following = np.arange(1, len(points) + 1)
    following[first[1:] - 1] = first[:-1]
    # relative to a corner of their own, so that polygons far from the origin keep their digits
    local = points - np.repeat(points[first[:-1]], sizes, axis=0)
    with np.errstate(all="ignore"):
        total = np.add.reduceat(np.cross(local, local[following]), first[:-1])
        return total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-300)


def _in_plane(points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Returns coordinates of points in planes with the given normals, counter-clockwise around them."""
    along = np.cross(np.eye(3)[np.abs(normals).argmin(axis=1)], normals)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-300)
    across = np.cross(normals, along)
    return np.stack([(points * along).sum(axis=1), (points * across).sum(axis=1)], axis=1)
