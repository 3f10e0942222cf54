"""Compiled: pinched vertices are carried along with the cloth around them."""

import numpy as np

from hemline.compiled import kernel

SWEEPS = 16
"""Passes over all pinched vertices; the folds in which cloth is pinched are narrower than this many vertices."""


@kernel
def carry_along(pinched, starts, neighbours, offsets_out):
    """Moves each pinched vertex by the mean displacement of its neighbours.

    Reads: pinched (pinched,): vertices with at least one neighbour; starts (verts + 1,) and neighbours: the vertices
        along the edges of each vertex, one vertex after the other.
    Writes: offsets_out (verts, 3): displacements of the pinched vertices [m], from those of the others.
    """
    for k in range(len(pinched)):
        offsets_out[pinched[k]] = 0
    for _ in range(SWEEPS):
        for k in range(len(pinched)):
            i = pinched[k]
            x, y, z = np.float32(0), np.float32(0), np.float32(0)
            for at in range(starts[i], starts[i + 1]):
                j = neighbours[at]
                x, y, z = x + offsets_out[j, 0], y + offsets_out[j, 1], z + offsets_out[j, 2]
            weight = np.float32(1) / np.float32(starts[i + 1] - starts[i])
            offsets_out[i, 0], offsets_out[i, 1], offsets_out[i, 2] = weight * x, weight * y, weight * z
