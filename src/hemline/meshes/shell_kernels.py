"""Compiled: rays along the axes of a grid are intersected with triangles, and winding numbers are summed."""

import numpy as np

from hemline.compiled import kernel, prange


@kernel
def solid_angle(point, corner):
    """Computes the solid angle of a triangle about a point.

    Source: van Oosterom, Strackee, "The Solid Angle of a Plane Triangle", 1983.

    Reads: point (3,) [m]; corner (3, 3): corners of the triangle [m].
    Returns: The angle, positive if the point is behind the triangle [sr].
    """
    ax, ay, az = corner[0, 0] - point[0], corner[0, 1] - point[1], corner[0, 2] - point[2]
    bx, by, bz = corner[1, 0] - point[0], corner[1, 1] - point[1], corner[1, 2] - point[2]
    cx, cy, cz = corner[2, 0] - point[0], corner[2, 1] - point[1], corner[2, 2] - point[2]
    la, lb = np.sqrt(ax * ax + ay * ay + az * az), np.sqrt(bx * bx + by * by + bz * bz)
    lc = np.sqrt(cx * cx + cy * cy + cz * cz)
    volume = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    ab, bc, ca = ax * bx + ay * by + az * bz, bx * cx + by * cy + bz * cz, cx * ax + cy * ay + cz * az
    return 2 * np.arctan2(volume, la * lb * lc + ab * lc + bc * la + ca * lb)


@kernel
def count_crossings(corners, first, second, along, low, spacing, crossings_out):
    """Counts signed crossings of the rays of a grid, each in the first cell centre beyond it.

    Reads: corners (faces, 3, 3) [m]; first, second: axes of the columns; along: axis of the rays; low (3,): lowest cell
        centres [m]; spacing [m].
    Writes: crossings_out (rows, columns, cells + 1): +1 where a ray enters, -1 where it leaves.
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


@kernel(parallel=True)
def wind_about(points, corners, starts, centres, radii, areas, beyond, winding_out):
    """Computes winding numbers of triangles about points; the triangles of a group that is far away count as one.

    Reads: points (points, 3) [m]; corners (faces, 3, 3) [m], group by group; starts (groups + 1,): first triangle of
        each group; centres (groups, 3), radii (groups,) [m], areas (groups, 3): sums of area vectors [m^2]; beyond:
        distance in radii from which a group is far.
    Writes: winding_out (points,).
    """
    for p in prange(len(points)):
        total = 0.0
        for g in range(len(centres)):
            x, y, z = centres[g, 0] - points[p, 0], centres[g, 1] - points[p, 1], centres[g, 2] - points[p, 2]
            square = x * x + y * y + z * z
            if square > (beyond * radii[g]) ** 2:
                total += (areas[g, 0] * x + areas[g, 1] * y + areas[g, 2] * z) / (square * np.sqrt(square))
            else:
                for f in range(starts[g], starts[g + 1]):
                    total += solid_angle(points[p], corners[f])
        winding_out[p] = total / (4 * np.pi)
