"""Finds where a garment passes through itself."""

import numpy as np

from hemline.arrays import Faces, Int, Vertices

from . import crossing_kernels as kernels
from .edges import edges

_CELLS_AT_MOST = 1 << 21


def self_crossings(vertices: Vertices, faces: Faces) -> dict[str, float]:
    """Counts triangles that cross another one of the same mesh, in one frame.

    Two triangles cross if an edge of one passes through the other. Triangles that share a vertex do not count, nor does
    contact in one plane. The test is in float64.

    Args:
        vertices: Positions [m].
        faces: Triangles.

    Returns:
        `pairs`, the crossing pairs of triangles, and `edge_percent`, the edges that pass through a triangle [percent].
    """
    pairs, crossed = _count(vertices, faces)
    return {"pairs": pairs, "edge_percent": 100 * len(crossed) / max(1, len(edges(faces)))}


def crossing_edges(vertices: Vertices, faces: Faces) -> Int[np.ndarray, "edges 2"]:
    """Returns the edges that pass through a triangle of the same mesh, as `self_crossings` counts them.

    Args:
        vertices: Positions [m].
        faces: Triangles.
    """
    return _count(vertices, faces)[1]


def _count(vertices: Vertices, faces: Faces) -> tuple[int, np.ndarray]:
    points = np.ascontiguousarray(vertices, np.float64)
    faces = np.ascontiguousarray(faces, np.int32)
    if not len(faces):
        return 0, np.empty((0, 2), np.int32)
    low, high, starts, members = _grid(points, faces)
    crossing = np.zeros((len(faces), 3), np.uint8)
    pairs = kernels.count_crossings(points, faces, low, high, starts, members, crossing)
    directed = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2)[crossing > 0]
    return int(pairs), np.unique(np.sort(directed, axis=1), axis=0)


def _grid(points: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Returns first and last cell of each triangle, grid size and starts of cells, and members of cells."""
    corners = points[faces]
    origin, top = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    extent = top - origin
    size = max(float(np.ptp(corners, axis=1).max(axis=1).mean()), float(extent.max()) / 1000, 1e-9)
    while np.prod(extent // size + 1) > _CELLS_AT_MOST:
        size *= 1.26
    low, high = np.empty((len(faces), 3), np.int64), np.empty((len(faces), 3), np.int64)
    kernels.cell_ranges(points, faces, origin, size, low, high)
    shape = high.max(axis=0) + 1
    counts = np.zeros(int(np.prod(shape)), np.int64)
    header = np.concatenate([shape, np.zeros(len(counts) + 1, np.int64)])
    kernels.fill_cells(low, high, counts, header, np.empty(0, np.int32))
    header[4:] = np.cumsum(counts)
    members = np.empty(int(header[-1]), np.int32)
    kernels.fill_cells(low, high, counts, header, members)
    return low, high, header, members
