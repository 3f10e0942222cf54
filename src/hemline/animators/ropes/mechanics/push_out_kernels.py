"""One node against one moving primitive, compiled: paper section 6 in the moving frame of the collider."""

import math

from hemline.collide.primitives.body_primitives import Colliders
from hemline.collide.primitives.primitive_kernels import ROUND_CONE, round_cone_distance
from hemline.compiled import kernel

from .joint_frame_kernels import rotate, to_rest, to_world
from .kernel_inputs import BodyMotion, ContactSettings
from .placed_kernels import GAP, PATH, measure_gaps

GRADIENT, HISTORY, SLIDE = 0.0, 1.0, 2.0
TOUCH_DEPTH = 1e-9
"""A node this deep [m] counts as outside."""


@kernel
def first_contact(kind, shapes, k, margin, start, end):
    """Finds where a path meets a primitive grown by margin.

    The distance to a convex primitive is convex along the path, so Newton's method from outside never overshoots.

    Reads: kind; shapes (prims, 16); primitive k; margin [m]; start (outside), end: x, y, z in the rest pose [m].
    Returns: the fraction of the path at which it meets the surface; 2 where it does not.
    """
    ax, ay, az = start
    x, y, z = end[0] - ax, end[1] - ay, end[2] - az
    fraction = 0.0
    for _ in range(20):
        found = round_cone_distance(shapes, k, ax + fraction * x, ay + fraction * y, az + fraction * z)
        gap = found[0] - margin
        if gap < 1e-7:
            return fraction
        slope = found[1] * x + found[2] * y + found[3] * z
        if slope >= 0.0:
            return 2.0
        fraction -= gap / slope
        if fraction > 1.0:
            return 2.0
    return fraction


@kernel
def contact_velocity(normal_x, normal_y, normal_z, bx, by, bz, friction, velocity_out):
    """Applies contact and friction to a node's velocity: Eq. 14 to 16.

    Reads: normal_x, normal_y, normal_z: unit normal; bx, by, bz: velocity of the collider there [m/s]; friction [1].
    Writes: velocity_out (3,): changed [m/s].
    """
    along = velocity_out[0] * normal_x + velocity_out[1] * normal_y + velocity_out[2] * normal_z
    body = bx * normal_x + by * normal_y + bz * normal_z
    new = max(along, body)
    x = velocity_out[0] - along * normal_x - (bx - body * normal_x)
    y = velocity_out[1] - along * normal_y - (by - body * normal_y)
    z = velocity_out[2] - along * normal_z - (bz - body * normal_z)
    size = math.sqrt(x * x + y * y + z * z)
    ratio = max(0.0, 1.0 - friction * (new - along) / size) if size > 1e-12 else 0.0
    velocity_out[0] = new * normal_x + (bx - body * normal_x) + ratio * x
    velocity_out[1] = new * normal_y + (by - body * normal_y) + ratio * y
    velocity_out[2] = new * normal_z + (bz - body * normal_z) + ratio * z


@kernel(inline="always")
def crossing_depth(colliders: Colliders, k, body: BodyMotion, margin, gap, start, end):
    """Measures how far a path goes on beyond the point where it enters a primitive.

    Reads: colliders; primitive k; body over the substep; margin [m]; gap: distance of the end to the primitive, less
        margin [m]; start, end: x, y, z of the node in the world [m].
    Returns: the length of that part, as seen from the primitive; 0 where the path does not enter [m].
    """
    kind, j = int(colliders.kinds[k]), int(colliders.joints[k])
    px, py, pz = to_rest(body.frames_to, j, end[0], end[1], end[2])
    qx, qy, qz = to_rest(body.frames_from, j, start[0], start[1], start[2])
    path = math.sqrt((px - qx) ** 2 + (py - qy) ** 2 + (pz - qz) ** 2)
    if gap >= path:
        return 0.0
    before = round_cone_distance(colliders.shapes, k, qx, qy, qz)[0] - margin
    if before <= 1e-6 or before + gap >= path:
        return 0.0
    return max(0.0, 1.0 - first_contact(kind, colliders.shapes, k, margin, (qx, qy, qz), (px, py, pz))) * path


@kernel(inline="always")
def deepest_collider(colliders: Colliders, placed, body: BodyMotion, margin, position_push, start, end):
    """Finds the primitive that a node is deepest in; a path right through one counts with the part beyond its entry.

    Reads: colliders; placed (PLACED, prims); body over the substep; margin [m]; position_push: `GRADIENT` ignores
        paths through a primitive; start, end: x, y, z of the node in the world [m].
    Writes: placed: rows GAP and PATH.
    Returns: the primitive (-1: none) and minus its depth [m].
    """
    worst, which = -TOUCH_DEPTH, -1
    kinds, joints, shapes, _, _ = colliders
    frames_to = body.frames_to
    x, y, z = end
    measure_gaps(placed, start[0], start[1], start[2], x, y, z)
    for k in range(placed.shape[1]):
        gap = placed[GAP, k] - margin
        if gap >= placed[PATH, k]:
            continue
        kind, j = int(kinds[k]), int(joints[k])
        if kind != ROUND_CONE:
            px, py, pz = to_rest(frames_to, j, x, y, z)
            gap = round_cone_distance(shapes, k, px, py, pz)[0] - margin
        if gap < worst:
            worst, which = gap, k
        elif position_push != GRADIENT and gap < placed[PATH, k]:
            through = crossing_depth(colliders, k, body, margin, gap, start, end)
            if -through < worst:
                worst, which = -through, k
    return which, worst


@kernel(inline="always")
def push_out(
    colliders: Colliders, k, body: BodyMotion, contact: ContactSettings, margin, start, position_out, velocity_out
):
    """Pushes a node out of a primitive.

    Reads: colliders; primitive k; body over the substep; contact; margin [m]; start (3,): where the node started the
        substep [m].
    Writes: position_out (3,) [m], velocity_out (3,) [m/s]: changed.
    """
    kind, j, shapes = int(colliders.kinds[k]), int(colliders.joints[k]), colliders.shapes
    frames_from, frames_to, h = body.frames_from, body.frames_to, body.duration
    px, py, pz = to_rest(frames_to, j, position_out[0], position_out[1], position_out[2])
    qx, qy, qz = to_rest(frames_from, j, start[0], start[1], start[2])
    now = round_cone_distance(shapes, k, px, py, pz)
    nx, ny, nz = now[1], now[2], now[3]
    depth = margin - now[0]
    ex, ey, ez = px + depth * nx, py + depth * ny, pz + depth * nz
    rx, ry, rz = qx - px, qy - py, qz - pz
    size = math.sqrt(rx * rx + ry * ry + rz * rz)
    before = round_cone_distance(shapes, k, qx, qy, qz)[0] - margin
    by_history = contact.position_push != GRADIENT and size > 1e-12 and before >= -1e-6
    if by_history:
        fraction = min(first_contact(kind, shapes, k, margin, (qx, qy, qz), (px, py, pz)), 1.0)
        ex, ey, ez = qx - fraction * rx, qy - fraction * ry, qz - fraction * rz
        entry = round_cone_distance(shapes, k, ex, ey, ez)
        nx, ny, nz = entry[1], entry[2], entry[3]
        lift = max(margin - entry[0], 0.0)
        ex, ey, ez = ex + lift * nx, ey + lift * ny, ez + lift * nz
        if contact.position_push == SLIDE:
            # the rest of the path runs along the tangent plane, which a convex primitive never crosses
            tx, ty, tz = px - ex, py - ey, pz - ez
            inward = min(tx * nx + ty * ny + tz * nz, 0.0)
            tx, ty, tz = tx - inward * nx, ty - inward * ny, tz - inward * nz
            rest = math.sqrt(tx * tx + ty * ty + tz * tz)
            ratio = max(0.0, 1.0 + contact.friction * inward / rest) if rest > 1e-12 else 0.0
            ex, ey, ez = ex + ratio * tx, ey + ratio * ty, ez + ratio * tz
    if contact.velocity_push == HISTORY and size > 1e-12 and before >= -1e-6:
        nx, ny, nz = rx / size, ry / size, rz / size
    ax, ay, az = to_world(frames_from, j, ex, ey, ez)
    bx, by, bz = to_world(frames_to, j, ex, ey, ez)
    nx, ny, nz = rotate(frames_to, j, nx, ny, nz)
    contact_velocity(nx, ny, nz, (bx - ax) / h, (by - ay) / h, (bz - az) / h, contact.friction, velocity_out)
    position_out[0], position_out[1], position_out[2] = bx, by, bz


@kernel(inline="always")
def limit_sliding_speed(colliders: Colliders, k, body: BodyMotion, start, position, velocity_out):
    """Limits a pushed node's speed along the surface to that of its real motion there.

    Otherwise what other constraints and friction hold back would pile up as the speed of a node that does not move.

    Reads: colliders; primitive k, which pushed the node; body over the substep; start, position (3,): where the node
        started the substep and where it came to rest [m].
    Writes: velocity_out (3,): changed [m/s].
    """
    j, frames_from, frames_to, h = int(colliders.joints[k]), body.frames_from, body.frames_to, body.duration
    px, py, pz = to_rest(frames_to, j, position[0], position[1], position[2])
    ax, ay, az = to_world(frames_from, j, px, py, pz)
    bx, by, bz = (position[0] - ax) / h, (position[1] - ay) / h, (position[2] - az) / h
    nx, ny, nz = world_normal(colliders, k, frames_to, position[0], position[1], position[2])
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


@kernel(inline="always")
def world_normal(colliders: Colliders, k, frames, x, y, z):
    """Computes the gradient of the distance to a primitive at a point.

    Reads: colliders; primitive k; frames (joints, 3, 4); x, y, z in the world [m].
    Returns: x, y, z of the unit gradient in the world.
    """
    j = int(colliders.joints[k])
    px, py, pz = to_rest(frames, j, x, y, z)
    found = round_cone_distance(colliders.shapes, k, px, py, pz)
    return rotate(frames, j, found[1], found[2], found[3])
