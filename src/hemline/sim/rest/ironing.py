"""Ironing: smooths cloth where it crosses itself, so that it can fall anew."""

import numpy as np
from jaxtyping import Bool, Int

from hemline.sim.cloth.sheet import Positions, Sheet

IRONING_INTERVAL = 15
"""Frames of damped dynamics between two ironings."""

MAX_IRONINGS = 6
"""Maximum number of ironings while cloth settles."""

SMOOTHING_ROUNDS = 5
"""Number of times that a vertex is moved to the mean of its neighbours."""


def iron(
    sheet: Sheet, positions: Positions, crossed: Int[np.ndarray, "edges 2"], free: Bool[np.ndarray, " verts"]
) -> Positions:
    """Smooths the cloth around crossings: each vertex there moves to the mean of its neighbours.

    Forces that shorten the curve of a crossing cannot open a fold that goes through its own neighbourhood: both sides
    belong to one crumple, and pulling one vertex out pushes the next one in.

    Args:
        sheet: The cloth.
        positions: Positions of the cloth [m].
        crossed: Edges that cross a triangle.
        free: Vertices that may move.

    Returns:
        The new positions [m].
    """
    count = sheet.vertex_count
    degree = np.diff(sheet.ring.starts.astype(np.int64))
    row, column = np.repeat(np.arange(count), degree), sheet.ring.columns.astype(np.int64)
    near = np.zeros(count, bool)
    near[crossed.ravel()] = True
    near[column[near[row]]] = True
    near &= free & (degree > 0)
    result, touched = positions.copy(), near[row]
    row, column = row[touched], column[touched]
    for _ in range(SMOOTHING_ROUNDS):
        total = np.stack([np.bincount(row, result[column, axis], count) for axis in range(3)], axis=1)
        result[near] = total[near] / degree[near, None]
    return result
