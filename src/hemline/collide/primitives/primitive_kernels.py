"""Signed distances of single primitives, compiled: one point, one primitive.

A primitive is a kind and a row of 16 numbers, in the rest frame of its joint:

```
ROUND_CONE  0:3 centre a   3:6 centre b   6 radius at a   7 radius at b      (a == b: sphere, equal radii: capsule)
ELLIPSOID   0:3 centre     3:6 radii      6:15 rotation, rows are the axes
BOX         0:3 centre     3:6 half sizes 6:15 rotation   15 rounding radius
```
All are exact Euclidean distances, so 1-Lipschitz; the gradient is the unit vector away from the closest surface point.
"""

import math

from hemline.compiled import kernel

ROUND_CONE, ELLIPSOID, BOX = 0, 1, 2


@kernel
def round_cone_distance(shapes, k, x, y, z):
    # model: shapes (prims, 16), the row k   in: point   out: distance, gradient
    ux, uy, uz = shapes[k, 3] - shapes[k, 0], shapes[k, 4] - shapes[k, 1], shapes[k, 5] - shapes[k, 2]
    px, py, pz = x - shapes[k, 0], y - shapes[k, 1], z - shapes[k, 2]
    radius, slope = shapes[k, 6], 0.0
    length = math.sqrt(ux * ux + uy * uy + uz * uz)
    difference = shapes[k, 6] - shapes[k, 7]
    if length <= abs(difference) or length < 1e-12:
        if difference < 0.0:
            px, py, pz, radius = x - shapes[k, 3], y - shapes[k, 4], z - shapes[k, 5], shapes[k, 7]
        foot, q = -1.0, 0.0
    else:
        ux, uy, uz = ux / length, uy / length, uz / length
        slope = difference / length
        along = px * ux + py * uy + pz * uz
        qx, qy, qz = px - along * ux, py - along * uy, pz - along * uz
        q = math.sqrt(qx * qx + qy * qy + qz * qz)
        cosine = math.sqrt(1.0 - slope * slope)
        foot = along - q * slope / cosine
        if foot >= length:
            px, py, pz, radius = x - shapes[k, 3], y - shapes[k, 4], z - shapes[k, 5], shapes[k, 7]
        elif foot > 0.0:
            if q < 1e-12:
                # on the axis: any direction across it will do
                qx, qy, qz = uy - uz, uz - ux, ux - uy
                if abs(qx) + abs(qy) + abs(qz) < 1e-6:
                    qx, qy, qz = uy, -ux, 0.0
                size = math.sqrt(qx * qx + qy * qy + qz * qz)
            else:
                size = q
            side = cosine / size
            return (
                q * cosine + along * slope - shapes[k, 6],
                side * qx + slope * ux,
                side * qy + slope * uy,
                side * qz + slope * uz,
            )
    size = math.sqrt(px * px + py * py + pz * pz)
    if size < 1e-12:
        return -radius, 0.0, 1.0, 0.0
    return size - radius, px / size, py / size, pz / size


@kernel
def round_cone_gap(shapes, k, x, y, z):
    # model: shapes (prims, 16), the row k   in: point   returns: the distance alone
    ux, uy, uz = shapes[k, 3] - shapes[k, 0], shapes[k, 4] - shapes[k, 1], shapes[k, 5] - shapes[k, 2]
    px, py, pz = x - shapes[k, 0], y - shapes[k, 1], z - shapes[k, 2]
    difference = shapes[k, 6] - shapes[k, 7]
    squared = ux * ux + uy * uy + uz * uz
    slack = squared - difference * difference
    if slack <= 0.0 or squared < 1e-24:
        if difference >= 0.0:
            return math.sqrt(px * px + py * py + pz * pz) - shapes[k, 6]
        px, py, pz = x - shapes[k, 3], y - shapes[k, 4], z - shapes[k, 5]
        return math.sqrt(px * px + py * py + pz * pz) - shapes[k, 7]
    # all lengths along the axis are multiplied by its length, to save a root
    along = px * ux + py * uy + pz * uz
    across = math.sqrt(max((px * px + py * py + pz * pz) * squared - along * along, 0.0))
    foot = along - across * difference / math.sqrt(slack)
    if foot <= 0.0:
        return math.sqrt(px * px + py * py + pz * pz) - shapes[k, 6]
    if foot >= squared:
        px, py, pz = x - shapes[k, 3], y - shapes[k, 4], z - shapes[k, 5]
        return math.sqrt(px * px + py * py + pz * pz) - shapes[k, 7]
    return (across * math.sqrt(slack) + along * difference) / squared - shapes[k, 6]


@kernel
def ellipsoid_distance(shapes, k, x, y, z):
    # model: shapes (prims, 16), the row k   in: point   out: distance, gradient
    px, py, pz = x - shapes[k, 0], y - shapes[k, 1], z - shapes[k, 2]
    a, b, c = shapes[k, 3], shapes[k, 4], shapes[k, 5]
    lx = shapes[k, 6] * px + shapes[k, 7] * py + shapes[k, 8] * pz
    ly = shapes[k, 9] * px + shapes[k, 10] * py + shapes[k, 11] * pz
    lz = shapes[k, 12] * px + shapes[k, 13] * py + shapes[k, 14] * pz
    tiny = 1e-9 * min(a, b, c)
    ax, ay, az = max(abs(lx), tiny), max(abs(ly), tiny), max(abs(lz), tiny)
    # Newton on sum (e y / (t + e^2))^2 = 1 from the left of the root: convex, falling, so it never overshoots
    t = max(a * (ax - a), b * (ay - b), c * (az - c))
    for _ in range(40):
        fx, fy, fz = a * ax / (t + a * a), b * ay / (t + b * b), c * az / (t + c * c)
        value = fx * fx + fy * fy + fz * fz - 1.0
        slope = 2.0 * (fx * fx / (t + a * a) + fy * fy / (t + b * b) + fz * fz / (t + c * c))
        step = value / slope
        t += step
        if step <= 1e-15 * (abs(t) + a * a):
            break
    qx, qy, qz = a * a * ax / (t + a * a), b * b * ay / (t + b * b), c * c * az / (t + c * c)
    nx, ny, nz = qx / (a * a), qy / (b * b), qz / (c * c)
    size = math.sqrt(nx * nx + ny * ny + nz * nz)
    distance = ((ax - qx) * nx + (ay - qy) * ny + (az - qz) * nz) / size
    nx, ny, nz = math.copysign(nx / size, lx), math.copysign(ny / size, ly), math.copysign(nz / size, lz)
    return (
        distance,
        shapes[k, 6] * nx + shapes[k, 9] * ny + shapes[k, 12] * nz,
        shapes[k, 7] * nx + shapes[k, 10] * ny + shapes[k, 13] * nz,
        shapes[k, 8] * nx + shapes[k, 11] * ny + shapes[k, 14] * nz,
    )


@kernel
def box_distance(shapes, k, x, y, z):
    # model: shapes (prims, 16), the row k   in: point   out: distance, gradient
    px, py, pz = x - shapes[k, 0], y - shapes[k, 1], z - shapes[k, 2]
    lx = shapes[k, 6] * px + shapes[k, 7] * py + shapes[k, 8] * pz
    ly = shapes[k, 9] * px + shapes[k, 10] * py + shapes[k, 11] * pz
    lz = shapes[k, 12] * px + shapes[k, 13] * py + shapes[k, 14] * pz
    qx, qy, qz = abs(lx) - shapes[k, 3], abs(ly) - shapes[k, 4], abs(lz) - shapes[k, 5]
    if qx > 0.0 or qy > 0.0 or qz > 0.0:
        nx, ny, nz = max(qx, 0.0), max(qy, 0.0), max(qz, 0.0)
        distance = math.sqrt(nx * nx + ny * ny + nz * nz)
        nx, ny, nz = nx / distance, ny / distance, nz / distance
    else:
        distance = max(qx, qy, qz)
        nx = 1.0 if qx == distance else 0.0
        ny = 1.0 if qy == distance and nx == 0.0 else 0.0
        nz = 1.0 - nx - ny
    nx, ny, nz = math.copysign(nx, lx), math.copysign(ny, ly), math.copysign(nz, lz)
    return (
        distance - shapes[k, 15],
        shapes[k, 6] * nx + shapes[k, 9] * ny + shapes[k, 12] * nz,
        shapes[k, 7] * nx + shapes[k, 10] * ny + shapes[k, 13] * nz,
        shapes[k, 8] * nx + shapes[k, 11] * ny + shapes[k, 14] * nz,
    )


@kernel
def primitive_distance(kind, shapes, k, x, y, z):
    # model: kind, shapes (prims, 16), the row k   in: point   out: distance, gradient
    if kind == ROUND_CONE:
        return round_cone_distance(shapes, k, x, y, z)
    if kind == ELLIPSOID:
        return ellipsoid_distance(shapes, k, x, y, z)
    return box_distance(shapes, k, x, y, z)


@kernel
def primitive_distances(kind, shapes, k, points, distances_out, gradients_out):
    # model: kind, shapes (prims, 16), the row k   in: points (points, 3)
    # out: distances_out (points,), gradients_out (points, 3)
    for i in range(points.shape[0]):
        found = primitive_distance(kind, shapes, k, points[i, 0], points[i, 1], points[i, 2])
        distances_out[i] = found[0]
        gradients_out[i, 0], gradients_out[i, 1], gradients_out[i, 2] = found[1], found[2], found[3]


@kernel
def union_distances(kinds, joints, shapes, frames, points, distances_out, nearest_out):
    # model: kinds, joints (prims,), shapes (prims, 16)   in: frames (joints, 3, 4) rest -> world, points (points, 3)
    # out: distances_out (points,) of the union, nearest_out (points,) the primitive
    for i in range(points.shape[0]):
        best, which = 1e30, -1
        for k in range(kinds.shape[0]):
            j = joints[k]
            x, y, z = points[i, 0] - frames[j, 0, 3], points[i, 1] - frames[j, 1, 3], points[i, 2] - frames[j, 2, 3]
            found = primitive_distance(
                kinds[k],
                shapes,
                k,
                frames[j, 0, 0] * x + frames[j, 1, 0] * y + frames[j, 2, 0] * z,
                frames[j, 0, 1] * x + frames[j, 1, 1] * y + frames[j, 2, 1] * z,
                frames[j, 0, 2] * x + frames[j, 1, 2] * y + frames[j, 2, 2] * z,
            )
            if found[0] < best:
                best, which = found[0], k
        distances_out[i], nearest_out[i] = best, which
