"""Compiled exchange of features between the vertices and the cells of a garment."""

import numpy as np

from hemline.compiled import kernel, prange


@kernel
def average_cells(values, cell, means_out):
    """Averages the features of the vertices of each cell.

    Reads: values (verts, width); cell (verts,): cell of each vertex.
    Writes: means_out (cells, width).
    """
    count = np.zeros(len(means_out), np.float32)
    means_out[...] = 0
    for v in range(len(values)):
        count[cell[v]] += 1
        for k in range(values.shape[1]):
            means_out[cell[v], k] += values[v, k]
    for c in range(len(means_out)):
        scale = 1 / max(count[c], np.float32(1))
        for k in range(means_out.shape[1]):
            means_out[c, k] *= scale


@kernel(parallel=True)
def gather_from_cells(cells, near, shares, bias, values_out):
    """Adds the weighted features of the cells that reach each vertex to a bias.

    Reads: cells (cells, width); near, shares (verts, near): cells that reach each vertex, and their weights; bias
        (width,).
    Writes: values_out (verts, width).
    """
    for v in prange(len(values_out)):
        for k in range(values_out.shape[1]):
            values_out[v, k] = bias[k]
        for i in range(near.shape[1]):
            share, c = shares[v, i], near[v, i]
            for k in range(values_out.shape[1]):
                values_out[v, k] += share * cells[c, k]
