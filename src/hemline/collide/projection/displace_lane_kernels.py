"""Compiled: eight vertices at once are projected onto their faces and lifted out of the skin.

The data of eight vertices lies in rows of eight numbers, so that the compiler treats a row as one vector. The
arithmetic is that of the scalar functions of `surface.surface_kernels`, to the last bit.
"""

import numpy as np

from hemline.compiled import kernel

LANES = 8
"""Vertices at once."""
CORNERS, WEIGHTS, SQUARED, POINT, OFFSET, NORMALS, ROWS = 0, 9, 11, 12, 15, 18, 27
"""First row of each quantity: corners a, b, c (9 rows), weights of b and c (2), squared distance (1), point (3), offset
(3) and normals at a, b, c (9); the last number is that of all rows."""


@kernel(forceinline=True)
def project_lanes(rows, within_out):
    """Projects each lane's point onto the plane of its face.

    Reads: rows (ROWS, LANES): corners relative to the points [m].
    Writes: the rows of weights and of the squared distance [m^2], as `nearest_weights` computes them; within_out
        (LANES,): whether the projection lies within the face; elsewhere the weights mean nothing.
    """
    one, least = np.float32(1), np.float32(1e-6)
    for i in range(LANES):
        ax, ay, az = rows[0, i], rows[1, i], rows[2, i]
        bx, by, bz = rows[3, i], rows[4, i], rows[5, i]
        cx, cy, cz = rows[6, i], rows[7, i], rows[8, i]
        abx, aby, abz, acx, acy, acz = bx - ax, by - ay, bz - az, cx - ax, cy - ay, cz - az
        d1, d2 = -(abx * ax + aby * ay + abz * az), -(acx * ax + acy * ay + acz * az)
        d3, d4 = -(abx * bx + aby * by + abz * bz), -(acx * bx + acy * by + acz * bz)
        d5, d6 = -(abx * cx + aby * cy + abz * cz), -(acx * cx + acy * cy + acz * cz)
        va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
        at_corner = ((d1 <= 0) & (d2 <= 0)) | ((d3 >= 0) & (d4 <= d3)) | ((d6 >= 0) & (d5 <= d6))
        on_edge = ((vc <= 0) & (d1 >= 0) & (d3 <= 0)) | ((vb <= 0) & (d2 >= 0) & (d6 <= 0))
        on_edge |= (va <= 0) & (d4 - d3 >= 0) & (d5 - d6 >= 0)
        scale = one / max(va + vb + vc, np.float32(1e-30))
        s, t = vb * scale, vc * scale
        r = one - s - t
        px, py, pz = r * ax + s * bx + t * cx, r * ay + s * by + t * cy, r * az + s * bz + t * cz
        rows[9, i], rows[10, i], rows[11, i] = s, t, px * px + py * py + pz * pz
        within_out[i] = (r > least) & (s > 0) & (t > 0) & ~(at_corner | on_edge)


@kernel(forceinline=True)
def lift_distance(distance, margin, gap):
    """Moves a vertex out of the skin: within (gap, margin), monotone, C1 at the margin.

    Reads: distance: that of the vertex, less than the margin [m]; margin, gap [m].
    Returns: The distance at which the vertex ends [m].
    """
    span = margin - gap
    return gap + span * span / (span + margin - distance)


@kernel(forceinline=True)
def lift_lanes(rows, margin, gap, tiny):
    """Moves the point of each lane out of the skin, along the normal at the nearest place of its face.

    Reads: rows (ROWS, LANES), corners in the frame of the points; margin, gap [m]; tiny: square of the least offset
        that counts [m^2].
    Writes: the moved points in the rows of points [m]; signed distances in the row of squared ones [m].
    """
    one, span = np.float32(1), margin - gap
    for i in range(LANES):
        s, t, x, y, z = rows[9, i], rows[10, i], rows[12, i], rows[13, i], rows[14, i]
        r = one - s - t
        cx = r * rows[0, i] + s * rows[3, i] + t * rows[6, i]
        cy = r * rows[1, i] + s * rows[4, i] + t * rows[7, i]
        cz = r * rows[2, i] + s * rows[5, i] + t * rows[8, i]
        nx = r * rows[18, i] + s * rows[21, i] + t * rows[24, i]
        ny = r * rows[19, i] + s * rows[22, i] + t * rows[25, i]
        nz = r * rows[20, i] + s * rows[23, i] + t * rows[26, i]
        scale = one / max(np.sqrt(nx * nx + ny * ny + nz * nz), np.float32(1e-20))
        nx, ny, nz = nx * scale, ny * scale, nz * scale
        rx, ry, rz = x - cx, y - cy, z - cz
        distance = np.sqrt(rows[11, i]) * (one if rx * nx + ry * ny + rz * nz >= 0 else -one)
        near = distance < margin
        below = distance if near else margin
        slope = span / (span + margin - below)
        up = lift_distance(below, margin, gap) - slope * below
        yx, yy, yz = cx + slope * rx + up * nx, cy + slope * ry + up * ny, cz + slope * rz + up * nz
        ox, oy, oz = rows[15, i], rows[16, i], rows[17, i]
        moved_before = ox * ox + oy * oy + oz * oz > tiny
        rise = (yx - x) * nx + (yy - y) * ny + (yz - z) * nz
        more = max(ox * nx + oy * ny + oz * nz - rise, np.float32(0)) if moved_before else np.float32(0)
        yx, yy, yz = (yx + more * nx, yy + more * ny, yz + more * nz) if moved_before else (yx, yy, yz)
        fx, fy, fz = (x + ox, y + oy, z + oz) if moved_before else (x, y, z)
        rows[11, i] = distance
        rows[12, i], rows[13, i], rows[14, i] = (yx, yy, yz) if near else (fx, fy, fz)
