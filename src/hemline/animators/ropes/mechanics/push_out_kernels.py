"""One node against one moving primitive, compiled: paper section 6 in the moving frame of the collider."""

import math

from hemline.collide.primitives.primitive_kernels import ROUND_CONE, primitive_distance
from hemline.compiled import kernel

from .joint_frame_kernels import to_rest, to_world, rotate
from .placed_kernels import GAP, WAY, measure

GRADIENT, HISTORY, SLIDE = 0.0, 1.0, 2.0
TOUCH = 1e-9
"""A node this deep [m] counts as outside."""


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
    nx, ny, nz = rotate(frames_to, j, nx, ny, nz)
    contact_velocity(nx, ny, nz, (bx - ax) / h, (by - ay) / h, (bz - az) / h, friction, velocity_out)
    position_out[0], position_out[1], position_out[2] = bx, by, bz


@kernel
def slow_down(kind, shapes, k, j, frames_from, frames_to, h, start, position, velocity_out):
    # model: one primitive, by which the node was pushed   in: where it started the substep h and where it came to rest
    # in/out: velocity_out (3,), along the surface not faster than the node really moved there: what other constraints
    #     and friction held back would otherwise pile up as the speed of a node that does not move
    px, py, pz = to_rest(frames_to, j, position[0], position[1], position[2])
    ax, ay, az = to_world(frames_from, j, px, py, pz)
    bx, by, bz = (position[0] - ax) / h, (position[1] - ay) / h, (position[2] - az) / h
    nx, ny, nz = world_normal(kind, shapes, k, j, frames_to, position[0], position[1], position[2])
    vx, vy, vz = velocity_out[0] - bx, velocity_out[1] - by, velocity_out[2] - bz
    along = vx * nx + vy * ny + vz * nz
    vx, vy, vz = vx - along * nx, vy - along * ny, vz - along * nz
    wx, wy, wz = (ax - start[0]) / h, (ay - start[1]) / h, (az - start[2]) / h
    inward = wx * nx + wy * ny + wz * nz
    wx, wy, wz = wx - inward * nx, wy - inward * ny, wz - inward * nz
    if wx * wx + wy * wy + wz * wz < vx * vx + vy * vy + vz * vz:
        velocity_out[0] = bx + along * nx + wx
        velocity_out[1] = by + along * ny + wy
        velocity_out[2] = bz + along * nz + wz


@kernel
def world_normal(kind, shapes, k, j, frames, x, y, z):
    # returns: gradient of the distance to primitive k at a point in the world
    px, py, pz = to_rest(frames, j, x, y, z)
    found = primitive_distance(kind, shapes, k, px, py, pz)
    return rotate(frames, j, found[1], found[2], found[3])
