"""Winding numbers by signed ray crossings: compiled code.

The predicate is watertight: both faces at an edge evaluate the same expression with the two products exchanged, which
IEEE arithmetic rounds alike, so a ray never slips between two faces nor hits both. It must therefore be compiled
without fused multiply-add and without fast-math. `projection.ray_kernels` uses the same predicate in float32, by leaves
of the body's surface; `bodies.overlap_kernels` has one of its own that breaks ties, for points that are vertices.
"""

import numpy as np

from hemline.compiled import kernel


@kernel(inline="always")
def crossing(au, av, bu, bv, cu, cv):
    """Winding number of the projected triangle a, b, c around the origin: -1, 0 or 1; and the three edge terms.

    Each edge that straddles the line v = 0 to the right of the origin counts +1 upward and -1 downward. Written with
    numbers in place of truth values, which vectorises.
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
def bin_points(points, low, cell, columns, rows, start_out, order_out):
    """Counting sort of points into a grid of columns over x and y; points off the grid are left out.

    in: points (n,3), low (2,), cell [m]; out: start_out (rows * columns + 1,), order_out (n,). Returns how many are on
    it.
    """
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
def add_crossings(vertices, faces, points, low, cell, columns, rows, start, order, winding_out):
    """Add to each binned point the signed crossings of its ray along +z with all faces.

    in: vertices (verts,3), faces (faces,3), points (n,3) and their bins; out: winding_out (n,).
    """
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
