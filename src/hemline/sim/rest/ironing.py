"""Crumples that go through themselves: ironed flat, so that the cloth can fall anew."""

import numpy as np
from jaxtyping import Bool, Int

from hemline.sim.cloth.sheet import Positions, Sheet

IRONING_INTERVAL = 15
"""Frames of damped dynamics from one ironing to the next."""

MAX_IRONINGS = 6
"""How often cloth is ironed while it settles, at most."""

SMOOTHING_ROUNDS = 5
"""How often a vertex is put between its neighbours."""


def iron(
    sheet: Sheet, positions: Positions, crossed: Int[np.ndarray, "edges 2"], free: Bool[np.ndarray, " verts"]
) -> Positions:
    """The cloth with every place that crosses itself smoothed: each vertex there goes to the mean of its neighbours.

    Forces that shorten the curve of a crossing cannot open a fold that goes through its own neighbourhood: both sides
    belong to one crumple, and pulling one vertex out puts the next one in.

    Args:
        sheet: The cloth.
        positions: Where it is [m].
        crossed: Edges that go through a triangle.
        free: Vertices that may be moved.
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
