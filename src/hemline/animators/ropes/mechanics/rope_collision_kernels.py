"""Rope nodes out of all primitives, root to tip, compiled: paper section 6, and the places left to a caught rope."""

import math

import numpy as np

from hemline.compiled import kernel

from .push_out_kernels import GRADIENT, deepest, push_out, slow_down, world_normal

REMEMBERED, ATTEMPTS = 4, 24
"""Push-outs of one node in one step: so many at most along its way, so many in all; the others along the gradient."""
LONGEST = 1.2
"""A rope that a push-out would stretch beyond this share of its length gives in."""
SHARES = (1.0, 0.5, 0.25, 0.0)
"""Distances from the node above at which it then looks for a free place, as shares of its length."""
TURNS = 16
"""So often the rope is turned along the surfaces in search of it."""
_POINTS = np.arange(64)
_HEIGHTS = (2.0 * _POINTS + 1.0) / len(_POINTS) - 1.0
_ANGLES = _POINTS * math.pi * (3.0 - math.sqrt(5.0))
DIRECTIONS = np.stack(
    [np.sqrt(1.0 - _HEIGHTS**2) * np.cos(_ANGLES), _HEIGHTS, np.sqrt(1.0 - _HEIGHTS**2) * np.sin(_ANGLES)], axis=1
)
"""Directions (64, 3) spread evenly over the sphere, along a golden spiral: tried where turning finds nothing."""


@kernel
def turn_free(kinds, joints, shapes, placed, frames_to, margin, reach, ax, ay, az, position_out):
    # in: the node above, reach of the rope   in/out: position_out, where the node wants to be
    # returns: whether a place outside of all was found on the sphere of radius reach: from the wanted direction along
    # the sphere, up the gradient of the deepest primitive (Newton's method); else the nearest free of DIRECTIONS
    x, y, z = position_out[0] - ax, position_out[1] - ay, position_out[2] - az
    size = math.sqrt(x * x + y * y + z * z)
    x, y, z = (x / size, y / size, z / size) if size > 1e-12 else (0.0, -1.0, 0.0)
    p, q, r = x, y, z
    for _ in range(TURNS):
        u, v, w = ax + reach * p, ay + reach * q, az + reach * r
        which, depth = deepest(kinds, joints, shapes, placed, frames_to, frames_to, margin, GRADIENT, u, v, w, u, v, w)
        if which < 0:
            position_out[0], position_out[1], position_out[2] = u, v, w
            return True
        nx, ny, nz = world_normal(int(kinds[which]), shapes, which, int(joints[which]), frames_to, u, v, w)
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
        if deepest(kinds, joints, shapes, placed, frames_to, frames_to, margin, GRADIENT, u, v, w, u, v, w)[0] < 0:
            nearest, which = near, k
            position_out[0], position_out[1], position_out[2] = u, v, w
    return which >= 0


@kernel
def march_out(kinds, joints, shapes, placed, frames_to, margin, position_out):
    # the last resort: straight on along the gradient of the deepest primitive until outside of all
    nx, ny, nz = 0.0, 0.0, 0.0
    for _ in range(80):
        x, y, z = position_out[0], position_out[1], position_out[2]
        which, depth = deepest(kinds, joints, shapes, placed, frames_to, frames_to, margin, 0.0, x, y, z, x, y, z)
        if which < 0:
            return
        if nx == 0.0 and ny == 0.0 and nz == 0.0:
            nx, ny, nz = world_normal(int(kinds[which]), shapes, which, int(joints[which]), frames_to, x, y, z)
        step = 1e-6 - depth
        position_out[0], position_out[1], position_out[2] = x + step * nx, y + step * ny, z + step * nz


@kernel
def let_go(kinds, joints, shapes, placed, frames_to, margin, length, ax, ay, az, position_out):
    # a chain that is caught: the free place within the rope's length that lies nearest to where it was pushed, the
    # node above's own at the latest; where that is inside too, straight out, whatever the length
    for share in SHARES:
        if turn_free(kinds, joints, shapes, placed, frames_to, margin, share * length, ax, ay, az, position_out):
            return
    march_out(kinds, joints, shapes, placed, frames_to, margin, position_out)


@kernel
def free_node(
    kinds,
    joints,
    shapes,
    placed,
    frames_from,
    frames_to,
    margin,
    friction,
    choice,
    velocity_choice,
    h,
    start,
    position_out,
    velocity_out,
):
    # model: the primitives   in: choices, substep h, start (3,)   in/out: position_out, velocity_out (3,)
    # returns: how many times it was pushed, deepest primitive first, ATTEMPTS where it is still inside one; and which
    #     primitive was the last
    last = -1
    for attempt in range(ATTEMPTS):
        way = choice if attempt < REMEMBERED else 0.0
        which, _ = deepest(
            kinds,
            joints,
            shapes,
            placed,
            frames_from,
            frames_to,
            margin,
            way,
            start[0],
            start[1],
            start[2],
            position_out[0],
            position_out[1],
            position_out[2],
        )
        if which < 0:
            return attempt, last
        last = which
        push_out(
            int(kinds[which]),
            shapes,
            which,
            int(joints[which]),
            frames_from,
            frames_to,
            margin,
            friction,
            way,
            velocity_choice,
            h,
            start,
            position_out,
            velocity_out,
        )
    return ATTEMPTS, last


@kernel
def resolve_chain(
    first,
    last,
    lengths,
    margins,
    kinds,
    joints,
    shapes,
    placed,
    frames_from,
    frames_to,
    friction,
    choice,
    velocity_choice,
    h,
    starts,
    positions_out,
    velocities_out,
    touched_out,
):
    # model: one chain, the primitives   in: choices (floats), substep h, starts (nodes, 3) at its beginning
    # in/out: positions_out, velocities_out (nodes, 3)   out: touched_out (nodes,)   returns: whether any touched
    # One pass from root to tip; for each node the length first, collisions last.
    any_touched = False
    for i in range(first + 1, last):
        ax, ay, az = positions_out[i - 1, 0], positions_out[i - 1, 1], positions_out[i - 1, 2]
        x, y, z = positions_out[i, 0], positions_out[i, 1], positions_out[i, 2]
        span = math.sqrt((x - ax) ** 2 + (y - ay) ** 2 + (z - az) ** 2)
        if span > lengths[i] * (1.0 + 1e-12):
            share = lengths[i] / span
            x, y, z = ax + share * (x - ax), ay + share * (y - ay), az + share * (z - az)
            positions_out[i, 0], positions_out[i, 1], positions_out[i, 2] = x, y, z
        position = positions_out[i]
        pushes, by = free_node(
            kinds,
            joints,
            shapes,
            placed,
            frames_from,
            frames_to,
            margins[i],
            friction,
            choice,
            velocity_choice,
            h,
            starts[i],
            position,
            velocities_out[i],
        )
        if pushes == 0:
            continue
        touched_out[i] = any_touched = True
        span = math.sqrt((position[0] - ax) ** 2 + (position[1] - ay) ** 2 + (position[2] - az) ** 2)
        if pushes == ATTEMPTS or span > LONGEST * lengths[i]:
            let_go(kinds, joints, shapes, placed, frames_to, margins[i], lengths[i], ax, ay, az, position)
        slow_down(
            int(kinds[by]),
            shapes,
            by,
            int(joints[by]),
            frames_from,
            frames_to,
            h,
            starts[i],
            position,
            velocities_out[i],
        )
    return any_touched
