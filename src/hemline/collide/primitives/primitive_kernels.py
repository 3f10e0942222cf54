"""Compiled: signed distances to rounded cones, one point and one cone at a time.

A primitive is a kind, of which there is only `ROUND_CONE`, and a row of 16 numbers in the rest frame of its joint [m]:
0:3 centre a, 3:6 centre b, 6 radius at a, 7 radius at b; the others are 0. With a == b it is a sphere, with equal radii
a capsule. Distances are exact (Euclidean), negative inside and 1-Lipschitz; the gradient is the unit vector away from
the closest surface point.
"""

import math

from hemline.compiled import kernel

ROUND_CONE = 0
"""The kind of a rounded cone in model files."""


@kernel
def round_cone_distance(shapes, k, x, y, z):
    """Computes the distance of a point to a rounded cone.

    Reads: shapes (prims, 16) [m]; k: the row; the point x, y, z in the rest frame of its joint [m].
    Returns: distance [m], and the three coordinates of its gradient.
    """
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
def round_cone_distances(shapes, k, points, distances_out, gradients_out):
    """Computes the distances of points to a rounded cone.

    Reads: shapes (prims, 16) [m]; k: the row; points (points, 3) in the rest frame of its joint [m].
    Writes: distances_out (points,) [m]; gradients_out (points, 3).
    """
    for i in range(points.shape[0]):
        result = round_cone_distance(shapes, k, points[i, 0], points[i, 1], points[i, 2])
        distances_out[i] = result[0]
        gradients_out[i, 0], gradients_out[i, 1], gradients_out[i, 2] = result[1], result[2], result[3]


@kernel
def union_distances(colliders, frames, points, distances_out, nearest_out):
    """Computes the distances of points to the union of all primitives.

    Reads: colliders; frames (joints, 3, 4): rest to world; points (points, 3) in the world [m].
    Writes: distances_out (points,) [m]; nearest_out (points,): the nearest primitive.
    """
    joints, shapes = colliders.joints, colliders.shapes
    for i in range(points.shape[0]):
        best, which = 1e30, -1
        for k in range(joints.shape[0]):
            j = joints[k]
            x, y, z = points[i, 0] - frames[j, 0, 3], points[i, 1] - frames[j, 1, 3], points[i, 2] - frames[j, 2, 3]
            result = round_cone_distance(
                shapes,
                k,
                frames[j, 0, 0] * x + frames[j, 1, 0] * y + frames[j, 2, 0] * z,
                frames[j, 0, 1] * x + frames[j, 1, 1] * y + frames[j, 2, 1] * z,
                frames[j, 0, 2] * x + frames[j, 1, 2] * y + frames[j, 2, 2] * z,
            )
            if result[0] < best:
                best, which = result[0], k
        distances_out[i], nearest_out[i] = best, which
