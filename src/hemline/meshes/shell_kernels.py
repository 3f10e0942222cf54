"""Compiled: where rays along an axis of a grid go into and out of triangles."""

import numpy as np

from hemline.compiled import kernel


@kernel
def count_crossings(corners, first, second, along, low, spacing, crossings_out):
    """Signed crossings of the rays of a grid, each counted in the first cell centre beyond it.

    in: corners (faces, 3, 3), the axes of the columns and that of the rays, lowest cell centres (3,), their spacing.
    out: crossings, one row a column and one number more a cell: +1 where a ray goes in, -1 where it comes out.
    """
    rows, columns, depth = crossings_out.shape
    for f in range(len(corners)):
        a, b, c = corners[f, 0], corners[f, 1], corners[f, 2]
        u0, v0, u1, v1, u2, v2 = a[first], a[second], b[first], b[second], c[first], c[second]
        area = (u1 - u0) * (v2 - v0) - (u2 - u0) * (v1 - v0)
        if area == 0:
            continue
        from_u = max(int(np.ceil((min(u0, u1, u2) - low[first]) / spacing)), 0)
        to_u = min(int(np.floor((max(u0, u1, u2) - low[first]) / spacing)), rows - 1)
        from_v = max(int(np.ceil((min(v0, v1, v2) - low[second]) / spacing)), 0)
        to_v = min(int(np.floor((max(v0, v1, v2) - low[second]) / spacing)), columns - 1)
        for i in range(from_u, to_u + 1):
            u = low[first] + i * spacing
            for j in range(from_v, to_v + 1):
                v = low[second] + j * spacing
                w0 = ((u1 - u) * (v2 - v) - (u2 - u) * (v1 - v)) / area
                w1 = ((u2 - u) * (v0 - v) - (u0 - u) * (v2 - v)) / area
                w2 = 1 - w0 - w1
                if w0 < 0 or w1 < 0 or w2 < 0:
                    continue
                at = w0 * a[along] + w1 * b[along] + w2 * c[along]
                beyond = int(np.ceil((at - low[along]) / spacing))
                if beyond < depth:
                    crossings_out[i, j, max(beyond, 0)] += -1 if area > 0 else 1
