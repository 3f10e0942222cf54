"""Primitives placed in the world at the end of a substep, and the distance of a node to all of them at once."""

import math

from hemline.collide.primitives.primitive_kernels import ROUND_CONE
from hemline.compiled import kernel

from .joint_frame_kernels import to_world

START, AXIS, LENGTH, SLOPE, COSINE, RADII = 0, 3, 6, 7, 8, 9
MIDDLE, SHIFT, TURN, GAP, WAY, PLACED = 11, 14, 17, 18, 19, 20
"""Rows of the placed primitives, one row a quantity, so that all are measured at once: where a rounded cone's axis
starts in the world at the end of a substep, unit axis, its length, sine and cosine of the slope of its side, radii at
both ends (for another primitive: of the ball around it); the axis' middle and its way, the chord of the turn; and what
`measure` finds."""


@kernel
def place_cone(shapes, frames, j, k, placed_out):
    # model: rounded cone k   in: frames   out: column k of placed_out; of a cone that is a ball, an axis of length 0
    x, y, z = to_world(frames, j, shapes[k, 0], shapes[k, 1], shapes[k, 2])
    u, v, w = to_world(frames, j, shapes[k, 3], shapes[k, 4], shapes[k, 5])
    first, second, square = shapes[k, 6], shapes[k, 7], 0.0
    for n in range(3):
        square += (shapes[k, n + 3] - shapes[k, n]) ** 2
    length = math.sqrt(square)
    if length < abs(first - second) + 1e-9:
        if second > first:
            x, y, z, first = u, v, w, second
        place_ball(x, y, z, first, k, placed_out)
        return
    slope = (first - second) / length
    placed_out[START, k], placed_out[START + 1, k], placed_out[START + 2, k] = x, y, z
    placed_out[AXIS, k], placed_out[AXIS + 1, k] = (u - x) / length, (v - y) / length
    placed_out[AXIS + 2, k] = (w - z) / length
    placed_out[LENGTH, k], placed_out[SLOPE, k], placed_out[COSINE, k] = length, slope, math.sqrt(1.0 - slope * slope)
    placed_out[RADII, k], placed_out[RADII + 1, k] = first, second


@kernel
def place_ball(x, y, z, radius, k, placed_out):
    placed_out[START, k], placed_out[START + 1, k], placed_out[START + 2, k] = x, y, z
    placed_out[AXIS, k], placed_out[AXIS + 1, k], placed_out[AXIS + 2, k] = 0.0, 0.0, 0.0
    placed_out[LENGTH, k], placed_out[SLOPE, k], placed_out[COSINE, k] = 0.0, 0.0, 1.0
    placed_out[RADII, k], placed_out[RADII + 1, k] = radius, radius


@kernel
def place_primitives(kinds, joints, shapes, centres, frames_from, frames_to, placed_out):
    # model: primitives, centres (prims, 4) with bounding radius   in: frames at both ends of a substep
    # in/out: placed_out (PLACED, prims): moved on from the end of the last substep
    for k in range(kinds.shape[0]):
        j = int(joints[k])
        if kinds[k] == ROUND_CONE:
            place_cone(shapes, frames_to, j, k, placed_out)
        else:
            x, y, z = to_world(frames_to, j, centres[k, 0], centres[k, 1], centres[k, 2])
            place_ball(x, y, z, centres[k, 3], k, placed_out)
        for n in range(3):
            middle = placed_out[START + n, k] + 0.5 * placed_out[LENGTH, k] * placed_out[AXIS + n, k]
            placed_out[SHIFT + n, k], placed_out[MIDDLE + n, k] = middle - placed_out[MIDDLE + n, k], middle
        turn = 0.0
        for a in range(3):
            for b in range(3):
                turn += (frames_to[j, a, b] - frames_from[j, a, b]) ** 2
        placed_out[TURN, k] = min(math.sqrt(turn), 1.0)


@kernel(fastmath={"contract"})
def measure(placed, sx, sy, sz, x, y, z):
    # in: way of a node from (sx, sy, sz) to (x, y, z)
    # in/out: placed: rows GAP: distance to each rounded cone, or to the ball around another primitive, and WAY: how
    #     far the node went, seen from the primitive (which turns about its middle), at most
    dx, dy, dz = x - sx, y - sy, z - sz
    for k in range(placed.shape[1]):
        px, py, pz = x - placed[START, k], y - placed[START + 1, k], z - placed[START + 2, k]
        ux, uy, uz = placed[AXIS, k], placed[AXIS + 1, k], placed[AXIS + 2, k]
        along, length = px * ux + py * uy + pz * uz, placed[LENGTH, k]
        qx, qy, qz = px - along * ux, py - along * uy, pz - along * uz
        square = qx * qx + qy * qy + qz * qz
        across, slope, cosine = math.sqrt(square), placed[SLOPE, k], placed[COSINE, k]
        first, last = placed[RADII, k], placed[RADII + 1, k]
        foot = along * cosine - across * slope
        beyond, radius = (along - length, last) if foot > 0.0 else (along, first)
        ball = math.sqrt(square + beyond * beyond) - radius
        side = across * cosine + along * slope - first
        gap = side if (foot > 0.0) & (foot < length * cosine) else ball
        mx, my, mz = dx - placed[SHIFT, k], dy - placed[SHIFT + 1, k], dz - placed[SHIFT + 2, k]
        # no further from the middle than that: along the axis, then across
        away = across + abs(along - 0.5 * length)
        placed[GAP, k] = gap
        placed[WAY, k] = math.sqrt(mx * mx + my * my + mz * mz) + placed[TURN, k] * away
