"""Primitives placed in the world at the end of a substep, and the distance of a node to all of them at once."""

import math

from hemline.collide.primitives.body_primitives import Colliders
from hemline.collide.primitives.primitive_kernels import ROUND_CONE
from hemline.compiled import kernel

from .joint_frame_kernels import to_world

START, AXIS, LENGTH, SLOPE, COSINE, RADII = 0, 3, 6, 7, 8, 9
MIDDLE, SHIFT, TURN, GAP, PATH, PLACED = 11, 14, 17, 18, 19, 20
"""Rows of the placed primitives. Each row holds one quantity, so that all primitives are measured at once.

START, AXIS, LENGTH: start of a rounded cone's axis in the world at the end of a substep [m], its unit direction, its
length [m]. SLOPE, COSINE: sine and cosine of the slope of the cone's side. RADII: radii at both ends [m]; another
primitive is represented by the ball around it. MIDDLE, SHIFT: the middle of the axis and its displacement in the
substep [m]. TURN: chord of the rotation. GAP, PATH: results of `measure_gaps` [m]. PLACED: number of rows."""


@kernel
def place_cone(shapes, frames, j, k, placed_out):
    """Places a rounded cone; one that is a ball gets an axis of length 0.

    Reads: shapes (prims, 16); frames (joints, 3, 4); joint j; primitive k.
    Writes: placed_out (PLACED, prims): column k.
    """
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
    """Places a ball.

    Reads: x, y, z: centre in the world [m]; radius [m]; primitive k.
    Writes: placed_out (PLACED, prims): column k.
    """
    placed_out[START, k], placed_out[START + 1, k], placed_out[START + 2, k] = x, y, z
    placed_out[AXIS, k], placed_out[AXIS + 1, k], placed_out[AXIS + 2, k] = 0.0, 0.0, 0.0
    placed_out[LENGTH, k], placed_out[SLOPE, k], placed_out[COSINE, k] = 0.0, 0.0, 1.0
    placed_out[RADII, k], placed_out[RADII + 1, k] = radius, radius


@kernel
def place_primitives(colliders: Colliders, frames_from, frames_to, placed_out):
    """Moves the placed primitives on from the end of the last substep.

    Reads: colliders; frames_from, frames_to (joints, 3, 4) at both ends of a substep; placed_out of the last substep.
    Writes: placed_out (PLACED, prims).
    """
    kinds, joints, shapes, centres, _ = colliders
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
def measure_gaps(placed, sx, sy, sz, x, y, z):
    """Measures the distance of a node to all primitives, and its path relative to each.

    The path is an upper bound of how far the node moved as seen from the primitive, which turns about its middle.

    Reads: placed (PLACED, prims); sx, sy, sz and x, y, z: where the node's path starts and ends [m].
    Writes: placed: row GAP, the distance to each rounded cone, or to the ball around another primitive; row PATH [m].
    """
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
        placed[PATH, k] = math.sqrt(mx * mx + my * my + mz * mz) + placed[TURN, k] * away
