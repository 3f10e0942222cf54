"""Compiled features of each vertex in one frame: where skinning puts it, how it trails behind, what is near it."""

import math

import numpy as np

from hemline.bodies.dual_quaternion_kernels import dual_quaternions
from hemline.collide.primitives.primitive_kernels import round_cone_distance
from hemline.compiled import kernel, prange

BODY_RANGE = 0.3
"""Distance up to which the body counts as near [m]."""
VECTOR_LIMIT = 0.5
"""Length that vectors approach but do not exceed [m]."""
DENORMAL_LIMIT = np.float32(1e-20)
"""Smaller numbers are replaced by zero, since denormal numbers are slow."""


@kernel(inline="always")
def _write_vector(out, v, column, turn, x, y, z):
    # rotates a vector of the world into the frame of the vertex and limits its length to VECTOR_LIMIT
    a, b, c, d = turn[0], -turn[1], -turn[2], -turn[3]
    e0, e1, e2 = 2 * (c * z - d * y), 2 * (d * x - b * z), 2 * (b * y - c * x)
    x, y, z = x + a * e0 + c * e2 - d * e1, y + a * e1 + d * e0 - b * e2, z + a * e2 + b * e1 - c * e0
    scale = 1 / math.sqrt(1 + (x * x + y * y + z * z) / (VECTOR_LIMIT * VECTOR_LIMIT))
    out[v, column], out[v, column + 1], out[v, column + 2] = x * scale, y * scale, z * scale
    return column + 3


@kernel(inline="always")
def _write_nearness(out, v, column, turn, colliders, frames, parts, x, y, z):
    # writes for each part of the body its nearness (1 on its surface, 0 at BODY_RANGE), and the direction away from it
    # scaled by the nearness
    best = np.full(parts[1][-1] + 1, np.inf)
    away = np.zeros((len(best), 3))
    for k in range(len(parts[0])):
        j = colliders[1][k]
        f = frames[j]
        px, py, pz = x - f[0, 3], y - f[1, 3], z - f[2, 3]
        lx = f[0, 0] * px + f[1, 0] * py + f[2, 0] * pz
        ly = f[0, 1] * px + f[1, 1] * py + f[2, 1] * pz
        lz = f[0, 2] * px + f[1, 2] * py + f[2, 2] * pz
        gx, gy, gz = lx - colliders[3][k, 0], ly - colliders[3][k, 1], lz - colliders[3][k, 2]
        part = parts[0][k]
        reach = min(best[part], BODY_RANGE) + colliders[3][k, 3]
        if gx * gx + gy * gy + gz * gz > reach * reach:
            continue
        distance, gx, gy, gz = round_cone_distance(colliders[2], k, lx, ly, lz)
        if distance < best[part] and distance < BODY_RANGE:
            best[part] = distance
            away[part, 0] = f[0, 0] * gx + f[0, 1] * gy + f[0, 2] * gz
            away[part, 1] = f[1, 0] * gx + f[1, 1] * gy + f[1, 2] * gz
            away[part, 2] = f[2, 0] * gx + f[2, 1] * gy + f[2, 2] * gz
    for part in range(len(best)):
        near = max(-1.0, 1 - best[part] / BODY_RANGE) if best[part] < BODY_RANGE else 0.0
        near = min(near, 2.0)
        out[v, column] = near
        _write_vector(out, v, column + 1, turn, near * away[part, 0], near * away[part, 1], near * away[part, 2])
        column += 4
    return column


@kernel(parallel=True)
def skin_and_turn(rest, joints, weights, transforms, positions_out, turns_out):
    # in: rest (verts, 3); joints, weights (verts, influences), the heaviest first; transforms (joints, 3, 4)
    # out: positions (verts, 3) blended linearly; turns (verts, 4), the blended quaternions
    duals = np.empty((len(transforms), 8), np.float32)
    dual_quaternions(transforms, duals)
    for v in prange(len(rest)):
        x, y, z, a, b, c, d = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        first = joints[v, 0]
        for i in range(joints.shape[1]):
            w, j = weights[v, i], joints[v, i]
            t, q = transforms[j], duals[j]
            x += w * (t[0, 0] * rest[v, 0] + t[0, 1] * rest[v, 1] + t[0, 2] * rest[v, 2] + t[0, 3])
            y += w * (t[1, 0] * rest[v, 0] + t[1, 1] * rest[v, 1] + t[1, 2] * rest[v, 2] + t[1, 3])
            z += w * (t[2, 0] * rest[v, 0] + t[2, 1] * rest[v, 1] + t[2, 2] * rest[v, 2] + t[2, 3])
            f = duals[first]
            w = -w if f[0] * q[0] + f[1] * q[1] + f[2] * q[2] + f[3] * q[3] < 0 else w
            a, b, c, d = a + w * q[0], b + w * q[1], c + w * q[2], d + w * q[3]
        scale = 1 / math.sqrt(a * a + b * b + c * c + d * d)
        positions_out[v, 0], positions_out[v, 1], positions_out[v, 2] = x, y, z
        turns_out[v, 0], turns_out[v, 1] = a * scale, b * scale
        turns_out[v, 2], turns_out[v, 3] = c * scale, d * scale


@kernel(parallel=True)
def remember(before, after, dt, lags, swings, memory, memory_out):
    # in: before, after (verts, 3): points at both ends of the step; lags (lags, 2), swings (swings, 4): coefficients of
    #     `memory.FilterStep`; memory (verts, lags + 2 swings + 1, 3): the trail of each lag, the trail and the velocity
    #     of each swing, and the velocity of the point
    # out: memory after the step
    count, last = len(lags), len(lags) + 2 * len(swings)
    for v in prange(len(before)):
        for axis in range(3):
            velocity = (after[v, axis] - before[v, axis]) / dt
            for k in range(count):
                trail = lags[k, 0] * memory[v, k, axis] - lags[k, 1] * velocity
                memory_out[v, k, axis] = trail if abs(trail) > DENORMAL_LIMIT else np.float32(0)
            for k in range(len(swings)):
                at = count + 2 * k
                trail, ending = memory[v, at, axis], memory[v, at + 1, axis] - velocity
                value = swings[k, 0] * trail + swings[k, 1] * ending
                memory_out[v, at, axis] = value if abs(value) > DENORMAL_LIMIT else np.float32(0)
                value = swings[k, 2] * trail + swings[k, 3] * ending + velocity
                memory_out[v, at + 1, axis] = value if abs(value) > DENORMAL_LIMIT else np.float32(0)
            memory_out[v, last, axis] = velocity


@kernel(parallel=True)
def describe(
    positions, turns, carried, trails, carried_trails, rates, colliders, frames, parts, points, rest_offsets, out
):
    # in: positions, turns: those of `skin_and_turn`; carried (verts, 3): positions if carried with the key joint;
    #     trails, carried_trails: memories of both; rates (swings,): times that turn a velocity into a length [s];
    #     colliders, frames, parts ((prims,), (parts,)): primitives of the body, and the part of the body of each;
    #     points (joints, 3): joints in the world; rest_offsets (verts, joints, 3): their features at rest
    # out: (verts, features) float32; all but the nearness are zero on a body that was always at rest
    last = trails.shape[1] - 1
    lags = last - 2 * len(rates)
    for v in prange(len(positions)):
        turn = turns[v]
        x, y, z = positions[v, 0], positions[v, 1], positions[v, 2]
        column = 0
        for which in range(2):
            memory = trails if which == 0 else carried_trails
            for k in range(lags):
                column = _write_vector(out, v, column, turn, memory[v, k, 0], memory[v, k, 1], memory[v, k, 2])
            for k in range(len(rates)):
                at, rate = lags + 2 * k, rates[k]
                column = _write_vector(out, v, column, turn, memory[v, at, 0], memory[v, at, 1], memory[v, at, 2])
                column = _write_vector(
                    out,
                    v,
                    column,
                    turn,
                    rate * (memory[v, at + 1, 0] - memory[v, last, 0]),
                    rate * (memory[v, at + 1, 1] - memory[v, last, 1]),
                    rate * (memory[v, at + 1, 2] - memory[v, last, 2]),
                )
        column = _write_vector(out, v, column, turn, carried[v, 0] - x, carried[v, 1] - y, carried[v, 2] - z)
        column = _write_vector(out, v, column, turn, 0.0, -0.5, 0.0)
        for which in range(2):
            if which == 0:
                column = _write_nearness(out, v, column, turn, colliders, frames, parts, x, y, z)
            else:
                column = _write_nearness(
                    out, v, column, turn, colliders, frames, parts, carried[v, 0], carried[v, 1], carried[v, 2]
                )
        for k in range(len(points)):
            at = column
            column = _write_vector(out, v, column, turn, points[k, 0] - x, points[k, 1] - y, points[k, 2] - z)
            for axis in range(3):
                out[v, at + axis] -= rest_offsets[v, k, axis]


@kernel(parallel=True)
def displace(positions, turns, displacements, out):
    # out (verts, 3) = positions + displacements (verts, 3) turned out of the vertices' frames
    for v in prange(len(positions)):
        a, b, c, d = turns[v, 0], turns[v, 1], turns[v, 2], turns[v, 3]
        x, y, z = displacements[v, 0], displacements[v, 1], displacements[v, 2]
        e0, e1, e2 = 2 * (c * z - d * y), 2 * (d * x - b * z), 2 * (b * y - c * x)
        out[v, 0] = positions[v, 0] + x + a * e0 + c * e2 - d * e1
        out[v, 1] = positions[v, 1] + y + a * e1 + d * e0 - b * e2
        out[v, 2] = positions[v, 2] + z + a * e2 + b * e1 - c * e0
