"""Collisions of rope nodes with all primitives, root to tip, compiled: paper section 6, and places for caught ropes."""

import math

import numpy as np

from hemline.collide.primitives.body_primitives import Colliders
from hemline.compiled import kernel

from .kernel_inputs import BodyMotion, Chains, ContactSettings, NodeArrays
from .push_out_kernels import GRADIENT, deepest_collider, limit_sliding_speed, push_out, world_normal

HISTORY_PUSHES, PUSHES = 4, 24
"""Largest number of push-outs of a node in one substep: along its path, and in all. The others follow the gradient."""
LARGEST_STRETCH = 1.2
"""A rope that a push-out would stretch beyond this ratio of its length moves to a free place instead."""
FREE_FRACTIONS = (1.0, 0.5, 0.25, 0.0)
"""Distances from the node above at which a free place is sought, as fractions of the rope's length."""
TURNS = 16
"""Largest number of times that the rope is turned along the surfaces in search of a free place."""
_POINTS = np.arange(64)
_HEIGHTS = (2.0 * _POINTS + 1.0) / len(_POINTS) - 1.0
_ANGLES = _POINTS * math.pi * (3.0 - math.sqrt(5.0))
DIRECTIONS = np.stack(
    [np.sqrt(1.0 - _HEIGHTS**2) * np.cos(_ANGLES), _HEIGHTS, np.sqrt(1.0 - _HEIGHTS**2) * np.sin(_ANGLES)], axis=1
)
"""Directions (64, 3) spread evenly over the sphere, along a golden spiral: tried where turning finds no free place."""


@kernel
def turn_to_free_place(colliders: Colliders, placed, frames, margin, reach, root, position_out):
    """Searches a place outside of all primitives on a sphere around the node above.

    From the wanted direction the search runs along the sphere, up the gradient of the deepest primitive (Newton's
    method). Where that fails it takes the nearest free one of `DIRECTIONS`.

    Reads: colliders; placed (PLACED, prims); frames (joints, 3, 4) at the end of the substep; margin [m]; reach: radius
        of the sphere [m]; root: x, y, z of the node above [m]; position_out: where the node should be [m].
    Writes: position_out (3,): the free place, if there is one [m].
    Returns: whether there is one.
    """
    ax, ay, az = root
    still = BodyMotion(frames, frames, 0.0)
    x, y, z = position_out[0] - ax, position_out[1] - ay, position_out[2] - az
    size = math.sqrt(x * x + y * y + z * z)
    x, y, z = (x / size, y / size, z / size) if size > 1e-12 else (0.0, -1.0, 0.0)
    p, q, r = x, y, z
    for _ in range(TURNS):
        u, v, w = ax + reach * p, ay + reach * q, az + reach * r
        which, depth = deepest_collider(colliders, placed, still, margin, GRADIENT, (u, v, w), (u, v, w))
        if which < 0:
            position_out[0], position_out[1], position_out[2] = u, v, w
            return True
        nx, ny, nz = world_normal(colliders, which, frames, u, v, w)
        along = nx * p + ny * q + nz * r
        nx, ny, nz = nx - along * p, ny - along * q, nz - along * r
        square = nx * nx + ny * ny + nz * nz
        if square < 1e-6 or reach == 0.0:
            break
        turn = min((1e-6 - depth) / (reach * square), 0.5 / math.sqrt(square))
        p, q, r = p + turn * nx, q + turn * ny, r + turn * nz
        size = math.sqrt(p * p + q * q + r * r)
        p, q, r = p / size, q / size, r / size
    nearest, which = -2.0, -1
    for k in range(DIRECTIONS.shape[0]):
        near = DIRECTIONS[k, 0] * x + DIRECTIONS[k, 1] * y + DIRECTIONS[k, 2] * z
        u, v, w = ax + reach * DIRECTIONS[k, 0], ay + reach * DIRECTIONS[k, 1], az + reach * DIRECTIONS[k, 2]
        if near <= nearest:
            continue
        if deepest_collider(colliders, placed, still, margin, GRADIENT, (u, v, w), (u, v, w))[0] < 0:
            nearest, which = near, k
            position_out[0], position_out[1], position_out[2] = u, v, w
    return which >= 0


@kernel
def march_out(colliders: Colliders, placed, frames, margin, position_out):
    """Moves a node straight on along the gradient of the deepest primitive until it is outside of all: the last resort.

    Reads: colliders; placed (PLACED, prims); frames (joints, 3, 4) at the end of the substep; margin [m].
    Writes: position_out (3,): changed [m].
    """
    still = BodyMotion(frames, frames, 0.0)
    nx, ny, nz = 0.0, 0.0, 0.0
    for _ in range(80):
        x, y, z = position_out[0], position_out[1], position_out[2]
        which, depth = deepest_collider(colliders, placed, still, margin, GRADIENT, (x, y, z), (x, y, z))
        if which < 0:
            return
        if nx == 0.0 and ny == 0.0 and nz == 0.0:
            nx, ny, nz = world_normal(colliders, which, frames, x, y, z)
        step = 1e-6 - depth
        position_out[0], position_out[1], position_out[2] = x + step * nx, y + step * ny, z + step * nz


@kernel
def find_free_place(colliders: Colliders, placed, frames, margin, length, root, position_out):
    """Moves the node of a caught rope to the nearest free place within the rope's length.

    The last place tried is that of the node above. Where that is inside, too, the node goes straight out, whatever the
    length of the rope.

    Reads: colliders; placed (PLACED, prims); frames (joints, 3, 4) at the end of the substep; margin, length of the
        rope [m]; root: x, y, z of the node above [m]; position_out: where the node was pushed [m].
    Writes: position_out (3,) [m].
    """
    for fraction in FREE_FRACTIONS:
        if turn_to_free_place(colliders, placed, frames, margin, fraction * length, root, position_out):
            return
    march_out(colliders, placed, frames, margin, position_out)


@kernel(inline="always")
def push_node_out(
    colliders: Colliders, placed, body: BodyMotion, contact: ContactSettings, margin, start, position_out, velocity_out
):
    """Pushes a node out of all primitives, the deepest first.

    Reads: colliders; placed (PLACED, prims); body over the substep; contact; margin [m]; start (3,): where the node
        started the substep [m].
    Writes: position_out (3,) [m], velocity_out (3,) [m/s]: changed.
    Returns: the number of pushes, `PUSHES` where it is still inside a primitive; and the last primitive (-1: none).
    """
    last = -1
    for attempt in range(PUSHES):
        push = contact.position_push if attempt < HISTORY_PUSHES else GRADIENT
        which, _ = deepest_collider(
            colliders,
            placed,
            body,
            margin,
            push,
            (start[0], start[1], start[2]),
            (position_out[0], position_out[1], position_out[2]),
        )
        if which < 0:
            return attempt, last
        last = which
        rule = ContactSettings(contact.friction, push, contact.velocity_push)
        push_out(colliders, which, body, rule, margin, start, position_out, velocity_out)
    return PUSHES, last


@kernel(inline="always")
def resolve_chain(
    chains: Chains,
    c,
    colliders: Colliders,
    placed,
    body: BodyMotion,
    contact: ContactSettings,
    starts,
    nodes_out: NodeArrays,
):
    """Shortens the ropes of a chain to their lengths and pushes its nodes out of the primitives, root to tip.

    The length of each rope comes first, collisions come last.

    Reads: chains; chain c; colliders; placed (PLACED, prims); body over the substep; contact; starts (nodes, 3):
        positions at the beginning of the substep [m].
    Writes: nodes_out: positions, velocities, touched.
    Returns: whether any node touched.
    """
    lengths, margins, first, last = chains.lengths, chains.margins, chains.offsets[c] + 1, chains.offsets[c + 1]
    positions, velocities, _, touched = nodes_out
    any_touched = False
    for i in range(first, last):
        ax, ay, az = positions[i - 1, 0], positions[i - 1, 1], positions[i - 1, 2]
        x, y, z = positions[i, 0], positions[i, 1], positions[i, 2]
        span = math.sqrt((x - ax) ** 2 + (y - ay) ** 2 + (z - az) ** 2)
        if span > lengths[i] * (1.0 + 1e-12):
            ratio = lengths[i] / span
            x, y, z = ax + ratio * (x - ax), ay + ratio * (y - ay), az + ratio * (z - az)
            positions[i, 0], positions[i, 1], positions[i, 2] = x, y, z
        position, velocity = positions[i], velocities[i]
        pushes, by = push_node_out(colliders, placed, body, contact, margins[i], starts[i], position, velocity)
        if pushes == 0:
            continue
        touched[i] = any_touched = True
        span = math.sqrt((position[0] - ax) ** 2 + (position[1] - ay) ** 2 + (position[2] - az) ** 2)
        if pushes == PUSHES or span > LARGEST_STRETCH * lengths[i]:
            find_free_place(colliders, placed, body.frames_to, margins[i], lengths[i], (ax, ay, az), position)
        limit_sliding_speed(colliders, by, body, starts[i], position, velocity)
    return any_touched
