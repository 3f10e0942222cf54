"""Rope nodes against moving primitives, compiled: paper section 6 in the moving frame of each collider."""

import math

import numpy as np

from hemline.collide.primitives.primitive_kernels import ROUND_CONE, primitive_distance
from hemline.compiled import kernel

GRADIENT, HISTORY, SLIDE = 0.0, 1.0, 2.0
TOUCH = 1e-9
"""A node this deep [m] counts as outside."""
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

START, AXIS, LENGTH, SLOPE, COSINE, RADII = 0, 3, 6, 7, 8, 9
MIDDLE, SHIFT, TURN, GAP, WAY, PLACED = 11, 14, 17, 18, 19, 20
"""Rows of the placed primitives, one row a quantity, so that all are measured at once: where a rounded cone's axis
starts in the world at the end of a substep, unit axis, its length, sine and cosine of the slope of its side, radii at
both ends (for another primitive: of the ball around it); the axis' middle and its way, the chord of the turn; and what
`measure` finds."""


@kernel
def to_rest(frames, j, x, y, z):
    x, y, z = x - frames[j, 0, 3], y - frames[j, 1, 3], z - frames[j, 2, 3]
    return (
        frames[j, 0, 0] * x + frames[j, 1, 0] * y + frames[j, 2, 0] * z,
        frames[j, 0, 1] * x + frames[j, 1, 1] * y + frames[j, 2, 1] * z,
        frames[j, 0, 2] * x + frames[j, 1, 2] * y + frames[j, 2, 2] * z,
    )


@kernel
def turned(frames, j, x, y, z):
    return (
        frames[j, 0, 0] * x + frames[j, 0, 1] * y + frames[j, 0, 2] * z,
        frames[j, 1, 0] * x + frames[j, 1, 1] * y + frames[j, 1, 2] * z,
        frames[j, 2, 0] * x + frames[j, 2, 1] * y + frames[j, 2, 2] * z,
    )


@kernel
def to_world(frames, j, x, y, z):
    u, v, w = turned(frames, j, x, y, z)
    return u + frames[j, 0, 3], v + frames[j, 1, 3], w + frames[j, 2, 3]


@kernel
def first_contact(kind, shapes, k, margin, ax, ay, az, bx, by, bz):
    # model: kind, shapes, row k   in: a path from a (outside) to b, in the rest frame
    # returns: the share of the path at which it meets the surface grown by margin; 2 where it does not
    # The distance to a convex primitive is convex along the path: Newton's method from outside never overshoots.
    x, y, z = bx - ax, by - ay, bz - az
    share = 0.0
    for _ in range(20):
        found = primitive_distance(kind, shapes, k, ax + share * x, ay + share * y, az + share * z)
        gap = found[0] - margin
        if gap < 1e-7:
            return share
        slope = found[1] * x + found[2] * y + found[3] * z
        if slope >= 0.0:
            return 2.0
        share -= gap / slope
        if share > 1.0:
            return 2.0
    return share


@kernel
def contact_velocity(normal_x, normal_y, normal_z, bx, by, bz, friction, velocity_out):
    # in: unit normal, velocity b of the collider there   in/out: velocity_out (3,)   (Eq. 14 to 16)
    along = velocity_out[0] * normal_x + velocity_out[1] * normal_y + velocity_out[2] * normal_z
    body = bx * normal_x + by * normal_y + bz * normal_z
    new = max(along, body)
    x = velocity_out[0] - along * normal_x - (bx - body * normal_x)
    y = velocity_out[1] - along * normal_y - (by - body * normal_y)
    z = velocity_out[2] - along * normal_z - (bz - body * normal_z)
    size = math.sqrt(x * x + y * y + z * z)
    kept = max(0.0, 1.0 - friction * (new - along) / size) if size > 1e-12 else 0.0
    velocity_out[0] = new * normal_x + (bx - body * normal_x) + kept * x
    velocity_out[1] = new * normal_y + (by - body * normal_y) + kept * y
    velocity_out[2] = new * normal_z + (bz - body * normal_z) + kept * z


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


@kernel
def crossing(kind, shapes, k, j, frames_from, frames_to, margin, gap, sx, sy, sz, x, y, z):
    # in: a way from (sx, sy, sz) to (x, y, z), which ends `gap` outside of primitive k
    # returns: how much of its way, seen from the primitive, lies beyond where it went in; 0 where it did not
    px, py, pz = to_rest(frames_to, j, x, y, z)
    qx, qy, qz = to_rest(frames_from, j, sx, sy, sz)
    way = math.sqrt((px - qx) ** 2 + (py - qy) ** 2 + (pz - qz) ** 2)
    if gap >= way:
        return 0.0
    before = primitive_distance(kind, shapes, k, qx, qy, qz)[0] - margin
    if before <= 1e-6 or before + gap >= way:
        return 0.0
    return max(0.0, 1.0 - first_contact(kind, shapes, k, margin, qx, qy, qz, px, py, pz)) * way


@kernel
def deepest(kinds, joints, shapes, placed, frames_from, frames_to, margin, choice, sx, sy, sz, x, y, z):
    # model: primitives, placed   in: way of a node from (sx, sy, sz) to (x, y, z)
    # returns: the deepest primitive (-1: none) and its depth; a way right through one counts with the part beyond
    worst, which = -TOUCH, -1
    measure(placed, sx, sy, sz, x, y, z)
    for k in range(placed.shape[1]):
        gap = placed[GAP, k] - margin
        if gap >= placed[WAY, k]:
            continue
        kind, j = int(kinds[k]), int(joints[k])
        if kind != ROUND_CONE:
            px, py, pz = to_rest(frames_to, j, x, y, z)
            gap = primitive_distance(kind, shapes, k, px, py, pz)[0] - margin
        if gap < worst:
            worst, which = gap, k
        elif choice != GRADIENT and gap < placed[WAY, k]:
            through = crossing(kind, shapes, k, j, frames_from, frames_to, margin, gap, sx, sy, sz, x, y, z)
            if -through < worst:
                worst, which = -through, k
    return which, worst


@kernel
def push_out(
    kind,
    shapes,
    k,
    j,
    frames_from,
    frames_to,
    margin,
    friction,
    position_choice,
    velocity_choice,
    h,
    start,
    position_out,
    velocity_out,
):
    # model: one primitive   in: choices, substep h, start (3,)   in/out: position_out, velocity_out (3,)
    px, py, pz = to_rest(frames_to, j, position_out[0], position_out[1], position_out[2])
    qx, qy, qz = to_rest(frames_from, j, start[0], start[1], start[2])
    now = primitive_distance(kind, shapes, k, px, py, pz)
    nx, ny, nz = now[1], now[2], now[3]
    depth = margin - now[0]
    ex, ey, ez = px + depth * nx, py + depth * ny, pz + depth * nz
    rx, ry, rz = qx - px, qy - py, qz - pz
    size = math.sqrt(rx * rx + ry * ry + rz * rz)
    before = primitive_distance(kind, shapes, k, qx, qy, qz)[0] - margin
    remembered = position_choice != GRADIENT and size > 1e-12 and before >= -1e-6
    if remembered:
        share = min(first_contact(kind, shapes, k, margin, qx, qy, qz, px, py, pz), 1.0)
        ex, ey, ez = qx - share * rx, qy - share * ry, qz - share * rz
        there = primitive_distance(kind, shapes, k, ex, ey, ez)
        nx, ny, nz = there[1], there[2], there[3]
        lift = max(margin - there[0], 0.0)
        ex, ey, ez = ex + lift * nx, ey + lift * ny, ez + lift * nz
        if position_choice == SLIDE:
            # the rest of the way runs along the tangent plane, which a convex primitive never crosses
            tx, ty, tz = px - ex, py - ey, pz - ez
            inward = min(tx * nx + ty * ny + tz * nz, 0.0)
            tx, ty, tz = tx - inward * nx, ty - inward * ny, tz - inward * nz
            rest = math.sqrt(tx * tx + ty * ty + tz * tz)
            kept = max(0.0, 1.0 + friction * inward / rest) if rest > 1e-12 else 0.0
            ex, ey, ez = ex + kept * tx, ey + kept * ty, ez + kept * tz
    if velocity_choice == HISTORY and size > 1e-12 and before >= -1e-6:
        nx, ny, nz = rx / size, ry / size, rz / size
    ax, ay, az = to_world(frames_from, j, ex, ey, ez)
    bx, by, bz = to_world(frames_to, j, ex, ey, ez)
    nx, ny, nz = turned(frames_to, j, nx, ny, nz)
    contact_velocity(nx, ny, nz, (bx - ax) / h, (by - ay) / h, (bz - az) / h, friction, velocity_out)
    position_out[0], position_out[1], position_out[2] = bx, by, bz


@kernel
def world_normal(kind, shapes, k, j, frames, x, y, z):
    # returns: gradient of the distance to primitive k at a point in the world
    px, py, pz = to_rest(frames, j, x, y, z)
    found = primitive_distance(kind, shapes, k, px, py, pz)
    return turned(frames, j, found[1], found[2], found[3])


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
    # returns: how many times it was pushed, deepest primitive first; ATTEMPTS where it is still inside one
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
            return attempt
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
    return ATTEMPTS


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
        pushes = free_node(
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
    return any_touched
