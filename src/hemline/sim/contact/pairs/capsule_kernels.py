"""Triangles of the cloth near moving capsules: compiled code."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from hemline.compiled import kernel
from hemline.sim.contact.body.touch_kernels import closest_on_triangle

from .pair_search_kernels import closest_on_edges

SEARCH_RADII = 2.0
"""Distance from the axis within which triangles are searched for, in radii."""


class MovingCapsules(NamedTuple):
    """Capsules in a step.

    Attributes:
        then: Ends of the axes at the start of the step [m].
        now: Ends of the axes at the end of the step [m].
        radius: Radii at both ends [m].
        limb: Limb of the body that contains each capsule.
    """

    then: Float[np.ndarray, "capsules 2 3"]
    now: Float[np.ndarray, "capsules 2 3"]
    radius: Float[np.ndarray, "capsules 2"]
    limb: Int[np.ndarray, " capsules"]


class CapsulePairs(NamedTuple):
    """Triangles that capsules hold off.

    Attributes:
        corners: Corners of each triangle, the last of them twice.
        weights: Weights of its nearest point.
        normal: Unit normal at the end of the step.
        point: Nearest point of the capsule's axis at the end of the step [m].
        radius: Radius of the capsule there [m].
    """

    corners: Int[np.ndarray, "room 4"]
    weights: Float[np.ndarray, "room 4"]
    normal: Float[np.ndarray, "room 3"]
    point: Float[np.ndarray, "room 3"]
    radius: Float[np.ndarray, " room"]


@kernel
def segment_hits_triangle(p, q, a, b, c):
    """Tells whether a segment goes through a triangle.

    Reads: p, q (3,): ends of the segment [m]; a, b, c (3,): corners of the triangle [m].
    Returns: Whether it does.
    """
    u0, u1, u2 = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    v0, v1, v2 = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    n0, n1, n2 = u1 * v2 - u2 * v1, u2 * v0 - u0 * v2, u0 * v1 - u1 * v0
    over_p = n0 * (p[0] - a[0]) + n1 * (p[1] - a[1]) + n2 * (p[2] - a[2])
    over_q = n0 * (q[0] - a[0]) + n1 * (q[1] - a[1]) + n2 * (q[2] - a[2])
    if over_p * over_q >= 0.0:
        return False
    t = over_p / (over_p - over_q)
    x, y, z = (p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1]), p[2] + t * (q[2] - p[2]))
    _, _, square = closest_on_triangle(x, y, z, a, b, c)
    return square < 1e-18


@kernel
def nearest_on_triangle(p, q, a, b, c):
    """Finds the nearest points of a segment and a triangle, which must not intersect.

    Reads: p, q (3,): ends of the segment [m]; a, b, c (3,): corners of the triangle [m].
    Returns: The position along the segment from 0 to 1, the weights of b and c, the squared distance [m^2].
    """
    at = 0.0
    v, w, least = closest_on_triangle(p[0], p[1], p[2], a, b, c)
    far_v, far_w, square = closest_on_triangle(q[0], q[1], q[2], a, b, c)
    if square < least:
        at, v, w, least = 1.0, far_v, far_w, square
    s, t, square = closest_on_edges(p, q, a, b)
    if square < least:
        at, v, w, least = s, t, 0.0, square
    s, t, square = closest_on_edges(p, q, b, c)
    if square < least:
        at, v, w, least = s, 1.0 - t, t, square
    s, t, square = closest_on_edges(p, q, c, a)
    if square < least:
        at, v, w, least = s, 0.0, 1.0 - t, square
    return at, v, w, least


@kernel
def _distance(a, b):
    """Computes the distance of two points.

    Reads: a, b (3,) [m].
    Returns: The distance [m].
    """
    return ((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2) ** 0.5


@kernel
def _off_axis(x, a, d, square):
    """Computes the distance of a point from a segment.

    Reads: x (3,) [m]; a (3,), d (3,): start of the segment, and from there to its end [m]; square: d . d [m^2].
    Returns: The distance [m].
    """
    r0, r1, r2 = x[0] - a[0], x[1] - a[1], x[2] - a[2]
    t = min(max((r0 * d[0] + r1 * d[1] + r2 * d[2]) / square, 0.0), 1.0)
    return ((r0 - t * d[0]) ** 2 + (r1 - t * d[1]) ** 2 + (r2 - t * d[2]) ** 2) ** 0.5


@kernel
def near_capsules(x, faces, limb_of_face, capsules: MovingCapsules, out: CapsulePairs):
    """Finds triangles close to the axis of a capsule in their own limb, and the normals that keep them off. Close means
    within `SEARCH_RADII` times the capsule's radius.

    Reads: x (verts, 3): the cloth at the start of the step [m]; faces (faces, 3); limb_of_face (faces,): -1 without
        contact; capsules.
    Writes: out: as many as there is room for.
    Returns: The number of triangles.
    """
    then, now, radius, limb = capsules
    corners_out, weights_out, normal_out, point_out, radius_out = out
    room, count = corners_out.shape[0], 0
    for k in range(then.shape[0]):
        p, q = then[k, 0], then[k, 1]
        d, e = q - p, now[k, 1] - now[k, 0]
        square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
        over = 1.0 / (square * (e[0] * e[0] + e[1] * e[1] + e[2] * e[2])) ** 0.5
        # the turn that takes the axis from its first direction to its second: axis times sine, and cosine
        s0, s1, s2 = (
            over * (d[1] * e[2] - d[2] * e[1]),
            over * (d[2] * e[0] - d[0] * e[2]),
            over * (d[0] * e[1] - d[1] * e[0]),
        )
        cosine = over * (d[0] * e[0] + d[1] * e[1] + d[2] * e[2])
        widest = SEARCH_RADII * max(radius[k, 0], radius[k, 1])
        for f in range(faces.shape[0]):
            if limb_of_face[f] != limb[k]:
                continue
            a, b, c = x[faces[f, 0]], x[faces[f, 1]], x[faces[f, 2]]
            reach = widest + max(_distance(a, b), _distance(a, c))
            if _off_axis(a, p, d, square) > reach or segment_hits_triangle(p, q, a, b, c):
                continue
            t, v, w, distance = nearest_on_triangle(p, q, a, b, c)
            distance = distance**0.5
            thick = (1.0 - t) * radius[k, 0] + t * radius[k, 1]
            if distance > SEARCH_RADII * thick or distance < 1e-9:
                continue
            if count < room:
                for corner in range(4):
                    corners_out[count, corner] = faces[f, min(corner, 2)]
                u = 1.0 - v - w
                weights_out[count, 0], weights_out[count, 1] = u, v
                weights_out[count, 2], weights_out[count, 3] = w, 0.0
                n0 = (u * a[0] + v * b[0] + w * c[0] - p[0] - t * d[0]) / distance
                n1 = (u * a[1] + v * b[1] + w * c[1] - p[1] - t * d[1]) / distance
                n2 = (u * a[2] + v * b[2] + w * c[2] - p[2] - t * d[2]) / distance
                along = (s0 * n0 + s1 * n1 + s2 * n2) / (1.0 + cosine)
                normal_out[count, 0] = cosine * n0 + s1 * n2 - s2 * n1 + along * s0
                normal_out[count, 1] = cosine * n1 + s2 * n0 - s0 * n2 + along * s1
                normal_out[count, 2] = cosine * n2 + s0 * n1 - s1 * n0 + along * s2
                for axis in range(3):
                    point_out[count, axis] = (1.0 - t) * now[k, 0, axis] + t * now[k, 1, axis]
                radius_out[count] = thick
            count += 1
    return count


__all__ = ["CapsulePairs", "MovingCapsules", "near_capsules", "nearest_on_triangle", "segment_hits_triangle"]
