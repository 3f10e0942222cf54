"""Spring bones as a player of VRM moves them, over a whole clip."""

import math

from hemline.compiled import kernel


@kernel
def rotated(turns, at, x, y, z):
    """Rotates a direction.

    Reads: turns (count, 3, 3): rotations; number of one; x, y, z.
    Returns: x, y, z.
    """
    return (
        turns[at, 0, 0] * x + turns[at, 0, 1] * y + turns[at, 0, 2] * z,
        turns[at, 1, 0] * x + turns[at, 1, 1] * y + turns[at, 1, 2] * z,
        turns[at, 2, 0] * x + turns[at, 2, 1] * y + turns[at, 2, 2] * z,
    )


@kernel
def rotated_back(turns, at, x, y, z):
    """Rotates a direction by the inverse of a rotation.

    Reads: turns (count, 3, 3): rotations; number of one; x, y, z.
    Returns: x, y, z.
    """
    return (
        turns[at, 0, 0] * x + turns[at, 1, 0] * y + turns[at, 2, 0] * z,
        turns[at, 0, 1] * x + turns[at, 1, 1] * y + turns[at, 2, 1] * z,
        turns[at, 0, 2] * x + turns[at, 1, 2] * y + turns[at, 2, 2] * z,
    )


@kernel
def limited(axes, bone, limits, x, y, z):
    """Turns a direction back into the range of its bone, as a spherical limit of `VRMC_springBone_limit` does.

    Reads: axes (bones, 3, 3): axes of the limit of each bone, as columns; number of the bone; limits (bones, 2):
        largest pitch and yaw [rad]; x, y, z: unit length, in the frame of the bone above.
    Returns: x, y, z.
    """
    if limits[bone, 0] >= math.pi:
        return x, y, z
    u, v, w = rotated_back(axes, bone, x, y, z)
    pitch, yaw = math.atan2(w, v), math.asin(min(max(u, -1.0), 1.0))
    if abs(pitch) <= limits[bone, 0] and abs(yaw) <= limits[bone, 1]:
        return x, y, z
    pitch = min(max(pitch, -limits[bone, 0]), limits[bone, 0])
    yaw = min(max(yaw, -limits[bone, 1]), limits[bone, 1])
    return rotated(axes, bone, math.sin(yaw), math.cos(yaw) * math.cos(pitch), math.cos(yaw) * math.sin(pitch))


@kernel
def put_between(turns_out, at, above, bone, way, direction):
    """Turns a bone on the shortest way from its direction at rest to another direction.

    Reads: numbers of the rotation to write and of that of the bone above; number of the bone in `way` (bones, 3):
        directions at rest; direction (3,): in the frame of the bone above.
    Writes: turns_out (count, 3, 3) at `at`.
    """
    ax, ay, az = way[bone, 0], way[bone, 1], way[bone, 2]
    bx, by, bz = direction
    norm = math.sqrt(bx * bx + by * by + bz * bz)
    bx, by, bz = bx / norm, by / norm, bz / norm
    cosine = ax * bx + ay * by + az * bz
    if cosine > -1.0 + 1e-6:
        cx, cy, cz, k = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx, 1.0 / (1.0 + cosine)
    else:
        # half a turn about any axis across
        cx, cy, cz = (-ay, ax, 0.0) if abs(ax) > abs(az) else (0.0, -az, ay)
        norm = math.sqrt(cx * cx + cy * cy + cz * cz)
        cx, cy, cz, k, cosine = cx / norm, cy / norm, cz / norm, 2.0, -1.0
    s = 1.0 if cosine > -1.0 else 0.0
    m00, m01, m02 = 1.0 - k * (cy * cy + cz * cz), k * cx * cy - s * cz, k * cx * cz + s * cy
    m10, m11, m12 = k * cx * cy + s * cz, 1.0 - k * (cx * cx + cz * cz), k * cy * cz - s * cx
    m20, m21, m22 = k * cx * cz - s * cy, k * cy * cz + s * cx, 1.0 - k * (cx * cx + cy * cy)
    for row in range(3):
        a, b, c = turns_out[above, row, 0], turns_out[above, row, 1], turns_out[above, row, 2]
        turns_out[at, row, 0] = a * m00 + b * m10 + c * m20
        turns_out[at, row, 1] = a * m01 + b * m11 + c * m21
        turns_out[at, row, 2] = a * m02 + b * m12 + c * m22


@kernel
def from_axis(start, end, x, y, z):
    """Returns the vector to a point from the closest point of a capsule's axis.

    Reads: start (3,) and end (3,) of the axis [m]; x, y, z [m].
    Returns: x, y, z [m].
    """
    wx, wy, wz = end[0] - start[0], end[1] - start[1], end[2] - start[2]
    px, py, pz = x - start[0], y - start[1], z - start[2]
    along = (px * wx + py * wy + pz * wz) / max(wx * wx + wy * wy + wz * wz, 1e-18)
    along = min(max(along, 0.0), 1.0)
    return px - along * wx, py - along * wy, pz - along * wz


@kernel
def pushed_out(capsules, frame, radius, x, y, z, collider):
    """Moves a point out of one capsule.

    Reads: capsules: see `SwingCapsules`; number of the frame; radius of the point [m]; x, y, z [m]; number of the
        capsule.
    Returns: whether it was moved, and x, y, z [m].
    """
    px, py, pz = from_axis(capsules.starts[frame, collider], capsules.ends[frame, collider], x, y, z)
    away = math.sqrt(px * px + py * py + pz * pz)
    missing = radius + capsules.radii[collider] - away
    if missing <= 0.0 or away < 1e-12:
        return False, x, y, z
    missing /= away
    return True, x + missing * px, y + missing * py, z + missing * pz


@kernel
def swing_chain(chain, springs, capsules, body, dt, tails_out, turns_out):
    """Swings one chain over all frames.

    Reads: number of the chain; springs: see `SwingSprings`; capsules: see `SwingCapsules`; body: see `SwingBody`;
        dt [s].
    Writes: tails_out (frames, bones, 3): the bones of the chain in the world [m]; turns_out (frames, bones, 3, 3): the
        rotation of each but the last from rest, and that of the carrying joint at the last.
    """
    first, last, joint = springs.offsets[chain], springs.offsets[chain + 1], springs.joints[chain]
    root = springs.roots[chain]
    for frame in range(len(body.joints)):
        before, earlier = max(frame - 1, 0), max(frame - 2, 0)
        ox, oy, oz = rotated(body.turns[frame], joint, root[0], root[1], root[2])
        at = body.joints[frame, joint]
        ox, oy, oz = ox + at[0], oy + at[1], oz + at[2]
        tails_out[frame, first, 0], tails_out[frame, first, 1], tails_out[frame, first, 2] = ox, oy, oz
        turns = turns_out[frame]
        turns[last - 1] = body.turns[frame, joint]
        above = last - 1
        for bone in range(first + 1, last):
            sx, sy, sz = rotated(
                turns, above, springs.directions[bone, 0], springs.directions[bone, 1], springs.directions[bone, 2]
            )
            length = springs.lengths[bone]
            if frame == 0:
                x, y, z = ox + length * sx, oy + length * sy, oz + length * sz
            else:
                kept, pull, fall = 1.0 - springs.drag[bone], springs.stiffness[bone] * dt, springs.gravity[bone] * dt
                now, then = tails_out[before, bone], tails_out[earlier, bone]
                x = now[0] + kept * (now[0] - then[0]) + pull * sx
                y = now[1] + kept * (now[1] - then[1]) + pull * sy - fall
                z = now[2] + kept * (now[2] - then[2]) + pull * sz
            for collider in range(-1, len(capsules.radii)):
                moved = True
                if collider >= 0:
                    if capsules.chains[collider] >= 0 and capsules.chains[collider] != chain:
                        continue
                    moved, x, y, z = pushed_out(capsules, frame, springs.radii[bone], x, y, z, collider)
                if moved:
                    x, y, z = x - ox, y - oy, z - oz
                    norm = math.sqrt(x * x + y * y + z * z)
                    x, y, z = rotated_back(turns, above, x / norm, y / norm, z / norm)
                    x, y, z = limited(springs.axes, bone, springs.limits, x, y, z)
                    x, y, z = rotated(turns, above, x, y, z)
                    x, y, z = ox + length * x, oy + length * y, oz + length * z
            tails_out[frame, bone, 0], tails_out[frame, bone, 1], tails_out[frame, bone, 2] = x, y, z
            direction = rotated_back(turns, above, (x - ox) / length, (y - oy) / length, (z - oz) / length)
            put_between(turns, bone - 1, above, bone, springs.directions, direction)
            above = bone - 1
            ox, oy, oz = x, y, z


@kernel
def swing_chains(springs, capsules, body, dt, tails_out, turns_out):
    """Swings all chains over all frames.

    Reads: springs, capsules, body and dt [s]: see `swing_chain`.
    Writes: tails_out (frames, bones, 3) [m] and turns_out (frames, bones, 3, 3): see `swing_chain`.
    """
    for chain in range(len(springs.joints)):
        swing_chain(chain, springs, capsules, body, dt, tails_out, turns_out)
