"""Rope nodes against moving primitives, compiled: paper section 6 in the moving frame of each collider."""

import math

from hemline.collide.primitive_kernels import primitive_distance
from hemline.compiled import kernel

GRADIENT, HISTORY, SLIDE = 0, 1, 2
TOUCH = 1e-9
"""A node this deep [m] counts as outside."""


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
def first_contact(kind, shape, margin, ax, ay, az, bx, by, bz):
    # model: kind, shape   in: a path from a (outside) to b, in the rest frame
    # returns: the share of the path at which it meets the surface grown by margin; 2 where it does not
    x, y, z = bx - ax, by - ay, bz - az
    length = math.sqrt(x * x + y * y + z * z)
    share = 0.0
    for _ in range(64):
        gap = primitive_distance(kind, shape, ax + share * x, ay + share * y, az + share * z)[0] - margin
        if gap < 1e-7:
            return share
        share += gap / max(length, 1e-12)
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
def deepest(
    kinds, joints, shapes, reaches, centres_from, centres_to, frames_from, frames_to, margin, position_choice, start, position
):  # fmt: skip
    # model: primitives; reaches (prims, 2): bounding radius, chord of the turn in this substep   in: start, position (3,)
    # returns: the deepest primitive (-1: none) and its depth; a path right through one counts with the way beyond
    worst, which = -TOUCH, -1
    x, y, z = position[0], position[1], position[2]
    mx, my, mz = x - start[0], y - start[1], z - start[2]
    for k in range(kinds.shape[0]):
        cx, cy, cz = x - centres_to[k, 0], y - centres_to[k, 1], z - centres_to[k, 2]
        away = math.sqrt(cx * cx + cy * cy + cz * cz)
        sx, sy, sz = (
            centres_to[k, 0] - centres_from[k, 0],
            centres_to[k, 1] - centres_from[k, 1],
            centres_to[k, 2] - centres_from[k, 2],
        )
        path = math.sqrt((mx - sx) * (mx - sx) + (my - sy) * (my - sy) + (mz - sz) * (mz - sz)) + reaches[k, 1] * away
        if away > reaches[k, 0] + margin + path:
            continue
        j = int(joints[k])
        px, py, pz = to_rest(frames_to, j, x, y, z)
        gap = primitive_distance(kinds[k], shapes[k], px, py, pz)[0] - margin
        if gap < worst:
            worst, which = gap, k
        elif position_choice != GRADIENT and gap < path:
            qx, qy, qz = to_rest(frames_from, j, start[0], start[1], start[2])
            before = primitive_distance(kinds[k], shapes[k], qx, qy, qz)[0] - margin
            if before > 1e-6 and before + gap < path:
                share = first_contact(kinds[k], shapes[k], margin, qx, qy, qz, px, py, pz)
                if share < 1.0 and -(1.0 - share) * path < worst:
                    worst, which = -(1.0 - share) * path, k
    return which, worst


@kernel
def push_out(kind, shape, j, frames_from, frames_to, margin, friction, position_choice, velocity_choice, h,
             start, position_out, velocity_out):  # fmt: skip
    # model: one primitive   in: choices, substep h, start (3,)   in/out: position_out, velocity_out (3,)
    px, py, pz = to_rest(frames_to, j, position_out[0], position_out[1], position_out[2])
    qx, qy, qz = to_rest(frames_from, j, start[0], start[1], start[2])
    now = primitive_distance(kind, shape, px, py, pz)
    nx, ny, nz = now[1], now[2], now[3]
    depth = margin - now[0]
    ex, ey, ez = px + depth * nx, py + depth * ny, pz + depth * nz
    rx, ry, rz = qx - px, qy - py, qz - pz
    size = math.sqrt(rx * rx + ry * ry + rz * rz)
    before = primitive_distance(kind, shape, qx, qy, qz)[0] - margin
    remembered = position_choice != GRADIENT and size > 1e-12 and before >= -1e-6
    if remembered:
        share = min(first_contact(kind, shape, margin, qx, qy, qz, px, py, pz), 1.0)
        ex, ey, ez = qx - share * rx, qy - share * ry, qz - share * rz
        there = primitive_distance(kind, shape, ex, ey, ez)
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
def march_out(kinds, joints, shapes, reaches, centres_to, frames_to, margin, position_out):
    # the last resort: straight on along the gradient of the deepest primitive until outside of all
    nx, ny, nz = 0.0, 0.0, 0.0
    for _ in range(200):
        which, depth = deepest(
            kinds, joints, shapes, reaches, centres_to, centres_to, frames_to, frames_to, margin, GRADIENT,
            position_out, position_out,
        )  # fmt: skip
        if which < 0:
            return
        if nx == 0.0 and ny == 0.0 and nz == 0.0:
            px, py, pz = to_rest(frames_to, joints[which], position_out[0], position_out[1], position_out[2])
            found = primitive_distance(kinds[which], shapes[which], px, py, pz)
            nx, ny, nz = turned(frames_to, joints[which], found[1], found[2], found[3])
        step = 1e-6 - depth
        position_out[0] += step * nx
        position_out[1] += step * ny
        position_out[2] += step * nz


@kernel
def resolve_chain(
    first, last, lengths, kinds, joints, shapes, reaches, centres_from, centres_to, frames_from, frames_to,
    margin, friction, position_choice, velocity_choice, h, starts, positions_out, velocities_out, touched_out,
):  # fmt: skip
    # model: one chain, the primitives   in: choices, substep h, starts (nodes, 3) at its beginning
    # in/out: positions_out, velocities_out (nodes, 3)   out: touched_out (nodes,)
    # One pass from root to tip; for each node the length first, collisions last.
    for i in range(first + 1, last):
        x = positions_out[i, 0] - positions_out[i - 1, 0]
        y = positions_out[i, 1] - positions_out[i - 1, 1]
        z = positions_out[i, 2] - positions_out[i - 1, 2]
        span = math.sqrt(x * x + y * y + z * z)
        if span > lengths[i] * (1.0 + 1e-12):
            share = lengths[i] / span
            positions_out[i, 0] = positions_out[i - 1, 0] + share * x
            positions_out[i, 1] = positions_out[i - 1, 1] + share * y
            positions_out[i, 2] = positions_out[i - 1, 2] + share * z
        inside = True
        for attempt in range(8):
            which, _ = deepest(
                kinds, joints, shapes, reaches, centres_from, centres_to, frames_from, frames_to, margin,
                position_choice if attempt < 4 else GRADIENT, starts[i], positions_out[i],
            )  # fmt: skip
            if which < 0:
                inside = False
                break
            touched_out[i] = True
            push_out(
                kinds[which], shapes[which], joints[which], frames_from, frames_to, margin, friction,
                position_choice if attempt < 4 else GRADIENT, velocity_choice, h,
                starts[i], positions_out[i], velocities_out[i],
            )  # fmt: skip
        if inside:
            march_out(kinds, joints, shapes, reaches, centres_to, frames_to, margin, positions_out[i])
