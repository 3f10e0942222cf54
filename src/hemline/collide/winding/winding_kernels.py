"""Compiled: winding numbers by signed ray crossings.

The predicate is watertight: both faces at an edge evaluate the same expression with the two products exchanged, which
IEEE arithmetic rounds alike, so a ray never slips between two faces nor hits both. It must therefore be compiled
without fused multiply-add and without fast-math. `projection.ray_kernels` uses the same predicate in float32, by leaves
of the body's surface; `bodies.untangling.overlap_kernels` has one of its own that breaks ties, for points that are
vertices.
"""

from typing import NamedTuple

import numpy as np

from hemline.arrays import Float, Int
from hemline.compiled import kernel


class ColumnGrid(NamedTuple):
    """A grid of columns over x and y, and the points in each column."""

    low: Float[np.ndarray, " 2"]
    """Lowest corner [m]."""
    cell: float
    """Edge length of a cell [m]."""
    columns: int
    """Cells along x."""
    rows: int
    """Cells along y."""
    start: Int[np.ndarray, " cells_and_one"]
    """Where the points of each cell begin in `order`; kernels write to it."""
    order: Int[np.ndarray, " points"]
    """Points cell by cell; kernels write to it."""


@kernel(inline="always")
def crossing(au, av, bu, bv, cu, cv):
    """Computes the winding number of the projected triangle a, b, c around the origin.

    Each edge that straddles the line v = 0 to the right of the origin counts +1 upward and -1 downward. It is written
    with numbers in place of truth values, which vectorises.

    Reads: two coordinates of each corner relative to the point [m].
    Returns: -1, 0 or 1; and the cross products of the corners of edges ab, bc and ca [m^2].
    """
    zero, one = np.float32(0), np.float32(1)
    ab, bc, ca = au * bv - av * bu, bu * cv - bv * cu, cu * av - cv * au
    a = one if av > zero else zero
    b = one if bv > zero else zero
    c = one if cv > zero else zero
    up_ab, up_bc, up_ca = b - a, c - b, a - c
    turns = up_ab if up_ab * ab > zero else zero
    turns += up_bc if up_bc * bc > zero else zero
    turns += up_ca if up_ca * ca > zero else zero
    return turns, ab, bc, ca


@kernel
def bin_points(points, grid_out):
    """Sorts points into the columns of a grid by counting; points off the grid are skipped.

    Reads: points (points, 3) [m].
    Writes: the start and order of grid_out.
    Returns: how many points are on the grid.
    """
    low, cell, columns, rows = grid_out.low, grid_out.cell, grid_out.columns, grid_out.rows
    start_out, order_out = grid_out.start, grid_out.order
    place = np.empty(len(points), np.int64)
    start_out[:] = 0
    for i in range(len(points)):
        column = (points[i, 0] - low[0]) / cell
        row = (points[i, 1] - low[1]) / cell
        place[i] = -1
        if 0 <= column < columns and 0 <= row < rows:
            place[i] = np.int64(row) * columns + np.int64(column)
            start_out[place[i] + 1] += 1
    for i in range(rows * columns):
        start_out[i + 1] += start_out[i]
    fill = start_out.copy()
    for i in range(len(points)):
        if place[i] >= 0:
            order_out[fill[place[i]]] = i
            fill[place[i]] += 1
    return start_out[rows * columns]


@kernel
def add_crossings(vertices, faces, points, grid, winding_out):
    """Adds to each binned point the signed crossings of its ray along +z with all faces.

    Reads: vertices (verts, 3) [m]; faces (faces, 3); points (points, 3) [m]; grid: the points' columns.
    Writes: winding_out (points,).
    """
    low, cell, columns, rows, start, order = grid.low, grid.cell, grid.columns, grid.rows, grid.start, grid.order
    for f in range(len(faces)):
        a, b, c = vertices[faces[f, 0]], vertices[faces[f, 1]], vertices[faces[f, 2]]
        top = max(a[2], b[2], c[2])
        left = np.int64(min(max((min(a[0], b[0], c[0]) - low[0]) / cell, 0), columns - 1))
        right = np.int64(min(max((max(a[0], b[0], c[0]) - low[0]) / cell, 0), columns - 1))
        below = np.int64(min(max((min(a[1], b[1], c[1]) - low[1]) / cell, 0), rows - 1))
        above = np.int64(min(max((max(a[1], b[1], c[1]) - low[1]) / cell, 0), rows - 1))
        for row in range(below, above + 1):
            for k in range(start[row * columns + left], start[row * columns + right + 1]):
                p = points[order[k]]
                if p[2] >= top:
                    continue
                turns, ab, bc, ca = crossing(
                    a[0] - p[0], a[1] - p[1], b[0] - p[0], b[1] - p[1], c[0] - p[0], c[1] - p[1]
                )
                if turns != 0:
                    volume = bc * (a[2] - p[2]) + ca * (b[2] - p[2]) + ab * (c[2] - p[2])
                    if volume * turns > 0:
                        winding_out[order[k]] += turns
