"""Compiled features of each vertex in one frame: where skinning puts it, how it trails behind, what is near it."""

import math

import numpy as np

from hemline.bodies.dual_quaternion_kernels import dual_quaternions
from hemline.collide.primitives.body_primitives import Colliders
from hemline.collide.primitives.primitive_kernels import round_cone_distance
from hemline.compiled import kernel, prange

from .columns import BODY_PARTS
from .kernel_inputs import TrailArrays

PART_COUNT = len(BODY_PARTS)
"""Number of parts of the body whose nearness is measured."""
BODY_RANGE = 0.3
"""Distance up to which the body counts as near [m]."""
VECTOR_LIMIT = 0.5
"""Length that vectors approach but do not exceed [m]."""
DENORMAL_LIMIT = np.float32(1e-20)
"""Smaller numbers are replaced by zero, since denormal numbers are slow."""


@kernel(inline="always")
def _write_vector(features_out, column, turn, x, y, z):
    """Rotates a vector into the frame of a vertex and limits its length to `VECTOR_LIMIT`.

    Reads: column: the first of three; turn (4,): rotation of the vertex, wxyz; x, y, z in the world.
    Writes: features_out (features,) of the vertex: three columns.
    Returns: the next column.
    """
    a, b, c, d = turn[0], -turn[1], -turn[2], -turn[3]
    e0, e1, e2 = 2 * (c * z - d * y), 2 * (d * x - b * z), 2 * (b * y - c * x)
    x, y, z = x + a * e0 + c * e2 - d * e1, y + a * e1 + d * e0 - b * e2, z + a * e2 + b * e1 - c * e0
    scale = 1 / math.sqrt(1 + (x * x + y * y + z * z) / (VECTOR_LIMIT * VECTOR_LIMIT))
    features_out[column], features_out[column + 1], features_out[column + 2] = x * scale, y * scale, z * scale
    return column + 3


@kernel(inline="always")
def _write_nearness(features_out, column, turn, colliders: Colliders, parts, frames, point):
    """Measures the nearness of each part of the body: 1 on its surface, 0 at `BODY_RANGE`.

    Reads: column: the first of four for each part; turn (4,): rotation of the vertex, wxyz; colliders; parts (prims,):
        part of the body of each; frames (joints, 3, 4): rest to world; point: x, y, z of the vertex [m].
    Writes: features_out (features,) of the vertex: for each part its nearness, and the direction away from it scaled by
        the nearness.
    Returns: the next column.
    """
    x, y, z = point
    best = np.full(PART_COUNT, np.inf)
    away = np.zeros((PART_COUNT, 3))
    for k in range(len(parts)):
        j = colliders.joints[k]
        f = frames[j]
        px, py, pz = x - f[0, 3], y - f[1, 3], z - f[2, 3]
        lx = f[0, 0] * px + f[1, 0] * py + f[2, 0] * pz
        ly = f[0, 1] * px + f[1, 1] * py + f[2, 1] * pz
        lz = f[0, 2] * px + f[1, 2] * py + f[2, 2] * pz
        ball = colliders.centres[k]
        gx, gy, gz = lx - ball[0], ly - ball[1], lz - ball[2]
        part = parts[k]
        reach = min(best[part], BODY_RANGE) + ball[3]
        if gx * gx + gy * gy + gz * gz > reach * reach:
            continue
        distance, gx, gy, gz = round_cone_distance(colliders.shapes, k, lx, ly, lz)
        if distance < best[part] and distance < BODY_RANGE:
            best[part] = distance
            away[part, 0] = f[0, 0] * gx + f[0, 1] * gy + f[0, 2] * gz
            away[part, 1] = f[1, 0] * gx + f[1, 1] * gy + f[1, 2] * gz
            away[part, 2] = f[2, 0] * gx + f[2, 1] * gy + f[2, 2] * gz
    for part in range(PART_COUNT):
        near = max(-1.0, 1 - best[part] / BODY_RANGE) if best[part] < BODY_RANGE else 0.0
        near = min(near, 2.0)
        features_out[column] = near
        column = _write_vector(
            features_out, column + 1, turn, near * away[part, 0], near * away[part, 1], near * away[part, 2]
        )
    return column


@kernel(parallel=True)
def skin_and_turn(rest, joints, weights, transforms, positions_out, turns_out):
    """Skins points: positions are blended linearly, rotations as quaternions.

    Reads: rest (verts, 3) [m]; joints, weights (verts, influences), the heaviest first; transforms (joints, 3, 4).
    Writes: positions_out (verts, 3) [m]; turns_out (verts, 4), wxyz.
    """
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
    """Advances the filters of moving points by one step.

    Reads: before, after (verts, 3): points at both ends of the step [m]; dt [s]; lags (lags, 2), swings (swings, 4):
        coefficients of `memory.FilterStep`; memory (verts, lags + 2 swings + 1, 3): the trail of each lag [m], the
        trail [m] and the velocity [m/s] of each swing, and the velocity of the point [m/s].
    Writes: memory_out, of the same shape: after the step.
    """
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
def describe(trail: TrailArrays, rates, colliders: Colliders, parts, frames, points, rest_offsets, features_out):
    """Computes the features that change; all but the nearness are zero on a body that was always at rest.

    Reads: trail; rates (swings,): times that turn a velocity into a length [s]; colliders of the body; parts (prims,):
        part of the body of each; frames (joints, 3, 4): rest to world; points (joints, 3): joints in the world [m];
        rest_offsets (verts, joints, 3): their features at rest.
    Writes: features_out (verts, features): the columns of `columns.DYNAMIC` before the beginning.
    """
    skinned, turns, carried, trails, carried_trails = trail
    last = trails.shape[1] - 1
    lags = last - 2 * len(rates)
    for v in prange(len(skinned)):
        turn, out = turns[v], features_out[v]
        x, y, z = skinned[v, 0], skinned[v, 1], skinned[v, 2]
        column = 0
        for which in range(2):
            memory = trails[v] if which == 0 else carried_trails[v]
            for k in range(lags):
                column = _write_vector(out, column, turn, memory[k, 0], memory[k, 1], memory[k, 2])
            for k in range(len(rates)):
                at, rate = lags + 2 * k, rates[k]
                column = _write_vector(out, column, turn, memory[at, 0], memory[at, 1], memory[at, 2])
                column = _write_vector(
                    out,
                    column,
                    turn,
                    rate * (memory[at + 1, 0] - memory[last, 0]),
                    rate * (memory[at + 1, 1] - memory[last, 1]),
                    rate * (memory[at + 1, 2] - memory[last, 2]),
                )
        column = _write_vector(out, column, turn, carried[v, 0] - x, carried[v, 1] - y, carried[v, 2] - z)
        column = _write_vector(out, column, turn, 0.0, -0.5, 0.0)
        for which in range(2):
            if which == 0:
                column = _write_nearness(out, column, turn, colliders, parts, frames, (x, y, z))
            else:
                away = (carried[v, 0], carried[v, 1], carried[v, 2])
                column = _write_nearness(out, column, turn, colliders, parts, frames, away)
        for k in range(len(points)):
            at = column
            column = _write_vector(out, column, turn, points[k, 0] - x, points[k, 1] - y, points[k, 2] - z)
            for axis in range(3):
                out[at + axis] -= rest_offsets[v, k, axis]


@kernel(parallel=True)
def displace(positions, turns, displacements, out):
    """Adds displacements to positions.

    Reads: positions (verts, 3) [m]; turns (verts, 4): frames of the vertices, wxyz; displacements (verts, 3) in these
        frames [m].
    Writes: out (verts, 3) [m].
    """
    for v in prange(len(positions)):
        a, b, c, d = turns[v, 0], turns[v, 1], turns[v, 2], turns[v, 3]
        x, y, z = displacements[v, 0], displacements[v, 1], displacements[v, 2]
        e0, e1, e2 = 2 * (c * z - d * y), 2 * (d * x - b * z), 2 * (b * y - c * x)
        out[v, 0] = positions[v, 0] + x + a * e0 + c * e2 - d * e1
        out[v, 1] = positions[v, 1] + y + a * e1 + d * e0 - b * e2
        out[v, 2] = positions[v, 2] + z + a * e2 + b * e1 - c * e0
