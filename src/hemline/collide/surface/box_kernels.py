"""Compiled: points are moved into the frame of a bone, and pieces of a surface are boxed there."""

import numpy as np

from hemline.compiled import kernel

_index = np.uintp
BLOCK = 8
"""Garment vertices in a block."""
GROUP = 64
"""Garment vertices in a group of blocks."""
LEAF = 8
"""Faces of a leaf."""


@kernel(fastmath={"contract"})
def into_frame(frame, points, order, out):
    """Moves points into the frame of a bone and reorders them: out[i] = R^T (points[order[i]] - t).

    The origin is subtracted first, so that rounding does not grow with the distance from the world's origin.

    Reads: frame (3, 4): bone to world, [R | t]; points (points, 3) in the world [m]; order (verts,).
    Writes: out (verts, 3) [m].
    """
    for i in range(len(order)):
        k = _index(order[i])
        x, y, z = points[k, 0] - frame[0, 3], points[k, 1] - frame[1, 3], points[k, 2] - frame[2, 3]
        for axis in range(3):
            out[i, axis] = frame[0, axis] * x + frame[1, axis] * y + frame[2, axis] * z


@kernel(fastmath={"contract"})
def out_of_frame(frame, points, order, out):
    """Moves points of a bone's frame into the world and back into their own order: out[order[i]] = frame points[i].

    Reads: frame (3, 4): bone to world; points (verts, 3) [m]; order (verts,).
    Writes: out (verts, 3) [m].
    """
    for i in range(len(order)):
        k = _index(order[i])
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        for axis in range(3):
            out[k, axis] = frame[axis, 0] * x + frame[axis, 1] * y + frame[axis, 2] * z + frame[axis, 3]


@kernel
def surface_boxes(body, leaf_start, leaf_vertices, patch_start, leaf_box_out, patch_box_out):
    """Computes the boxes of leaves and patches: three lowest, then three highest coordinates.

    Reads: body (body_verts, 3) [m]; leaf_start (leaves + 1,), leaf_vertices and patch_start (patches + 1,) of
        `Patches`.
    Writes: leaf_box_out (6, leaves), patch_box_out (6, patches) [m].
    """
    for leaf in range(leaf_box_out.shape[1]):
        first = _index(leaf_vertices[leaf_start[leaf]])
        lx, ly, lz = body[first, 0], body[first, 1], body[first, 2]
        hx, hy, hz = lx, ly, lz
        for k in range(leaf_start[leaf] + 1, leaf_start[leaf + 1]):
            v = _index(leaf_vertices[_index(k)])
            x, y, z = body[v, 0], body[v, 1], body[v, 2]
            lx, ly, lz = min(lx, x), min(ly, y), min(lz, z)
            hx, hy, hz = max(hx, x), max(hy, y), max(hz, z)
        leaf_box_out[0, leaf], leaf_box_out[1, leaf], leaf_box_out[2, leaf] = lx, ly, lz
        leaf_box_out[3, leaf], leaf_box_out[4, leaf], leaf_box_out[5, leaf] = hx, hy, hz
    for row in range(6):
        for patch in range(patch_box_out.shape[1]):
            value = leaf_box_out[row, _index(patch_start[patch])]
            for leaf in range(patch_start[patch] + 1, patch_start[patch + 1]):
                other = leaf_box_out[row, _index(leaf)]
                value = min(value, other) if row < 3 else max(value, other)
            patch_box_out[row, patch] = value
