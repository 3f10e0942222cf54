"""Frames of the body's joints: points into and out of them, and frames between two poses."""

import math

from hemline.compiled import kernel


@kernel
def to_rest(frames, j, x, y, z):
    """Moves a point from the world to the rest pose.

    Reads: frames (joints, 3, 4): rest to world; joint j; x, y, z [m].
    Returns: x, y, z at rest [m].
    """
    x, y, z = x - frames[j, 0, 3], y - frames[j, 1, 3], z - frames[j, 2, 3]
    return (
        frames[j, 0, 0] * x + frames[j, 1, 0] * y + frames[j, 2, 0] * z,
        frames[j, 0, 1] * x + frames[j, 1, 1] * y + frames[j, 2, 1] * z,
        frames[j, 0, 2] * x + frames[j, 1, 2] * y + frames[j, 2, 2] * z,
    )


@kernel
def rotate(frames, j, x, y, z):
    """Rotates a direction from the rest pose to the world.

    Reads: frames (joints, 3, 4); joint j; x, y, z.
    Returns: x, y, z in the world.
    """
    return (
        frames[j, 0, 0] * x + frames[j, 0, 1] * y + frames[j, 0, 2] * z,
        frames[j, 1, 0] * x + frames[j, 1, 1] * y + frames[j, 1, 2] * z,
        frames[j, 2, 0] * x + frames[j, 2, 1] * y + frames[j, 2, 2] * z,
    )


@kernel
def to_world(frames, j, x, y, z):
    """Moves a point from the rest pose to the world.

    Reads: frames (joints, 3, 4): rest to world; joint j; x, y, z at rest [m].
    Returns: x, y, z [m].
    """
    u, v, w = rotate(frames, j, x, y, z)
    return u + frames[j, 0, 3], v + frames[j, 1, 3], w + frames[j, 2, 3]


@kernel
def quaternion_of(frames, j):
    """Converts the rotation of a joint to a quaternion.

    Reads: frames (joints, 3, 4); joint j.
    Returns: w, x, y, z.
    """
    a, b, c = frames[j, 0, 0], frames[j, 1, 1], frames[j, 2, 2]
    if a + b + c > 0.0:
        s = 2.0 * math.sqrt(1.0 + a + b + c)
        return (
            s / 4.0,
            (frames[j, 2, 1] - frames[j, 1, 2]) / s,
            (frames[j, 0, 2] - frames[j, 2, 0]) / s,
            (frames[j, 1, 0] - frames[j, 0, 1]) / s,
        )
    if a >= b and a >= c:
        s = 2.0 * math.sqrt(1.0 + a - b - c)
        return (
            (frames[j, 2, 1] - frames[j, 1, 2]) / s,
            s / 4.0,
            (frames[j, 0, 1] + frames[j, 1, 0]) / s,
            (frames[j, 0, 2] + frames[j, 2, 0]) / s,
        )
    if b >= c:
        s = 2.0 * math.sqrt(1.0 - a + b - c)
        return (
            (frames[j, 0, 2] - frames[j, 2, 0]) / s,
            (frames[j, 0, 1] + frames[j, 1, 0]) / s,
            s / 4.0,
            (frames[j, 1, 2] + frames[j, 2, 1]) / s,
        )
    s = 2.0 * math.sqrt(1.0 - a - b + c)
    return (
        (frames[j, 1, 0] - frames[j, 0, 1]) / s,
        (frames[j, 0, 2] + frames[j, 2, 0]) / s,
        (frames[j, 1, 2] + frames[j, 2, 1]) / s,
        s / 4.0,
    )


@kernel
def copy_frames(frames, frames_out):
    """Copies transforms.

    Reads: frames (joints, 3, 4).
    Writes: frames_out (joints, 3, 4).
    """
    for j in range(frames.shape[0]):
        for a in range(3):
            for b in range(4):
                frames_out[j, a, b] = frames[j, a, b]


@kernel
def frames_between(frames_from, frames_to, pivots, fraction, frames_out):
    """Interpolates between two poses: pivots on straight lines, rotations by slerp.

    Reads: frames_from, frames_to (joints, 3, 4); pivots (joints, 3): joints at rest [m]; fraction 0..1.
    Writes: frames_out (joints, 3, 4).
    """
    if fraction >= 1.0:
        copy_frames(frames_to, frames_out)
        return
    for j in range(pivots.shape[0]):
        w0, x0, y0, z0 = quaternion_of(frames_from, j)
        w1, x1, y1, z1 = quaternion_of(frames_to, j)
        dot = w0 * w1 + x0 * x1 + y0 * y1 + z0 * z1
        sign = 1.0 if dot >= 0.0 else -1.0
        angle = math.acos(min(abs(dot), 1.0))
        first, second = 1.0 - fraction, fraction * sign
        if angle > 1e-6:
            first, second = (
                math.sin((1.0 - fraction) * angle) / math.sin(angle),
                sign * math.sin(fraction * angle) / math.sin(angle),
            )
        w, x, y, z = (
            first * w0 + second * w1,
            first * x0 + second * x1,
            first * y0 + second * y1,
            first * z0 + second * z1,
        )
        n = 2.0 / max(w * w + x * x + y * y + z * z, 1e-30)
        frames_out[j, 0, 0], frames_out[j, 0, 1], frames_out[j, 0, 2] = (
            1.0 - n * (y * y + z * z),
            n * (x * y - w * z),
            n * (x * z + w * y),
        )
        frames_out[j, 1, 0], frames_out[j, 1, 1], frames_out[j, 1, 2] = (
            n * (x * y + w * z),
            1.0 - n * (x * x + z * z),
            n * (y * z - w * x),
        )
        frames_out[j, 2, 0], frames_out[j, 2, 1], frames_out[j, 2, 2] = (
            n * (x * z - w * y),
            n * (y * z + w * x),
            1.0 - n * (x * x + y * y),
        )
        px, py, pz = pivots[j, 0], pivots[j, 1], pivots[j, 2]
        ax, ay, az = to_world(frames_from, j, px, py, pz)
        bx, by, bz = to_world(frames_to, j, px, py, pz)
        frames_out[j, 0, 3] = (
            ax + fraction * (bx - ax) - (frames_out[j, 0, 0] * px + frames_out[j, 0, 1] * py + frames_out[j, 0, 2] * pz)
        )
        frames_out[j, 1, 3] = (
            ay + fraction * (by - ay) - (frames_out[j, 1, 0] * px + frames_out[j, 1, 1] * py + frames_out[j, 1, 2] * pz)
        )
        frames_out[j, 2, 3] = (
            az + fraction * (bz - az) - (frames_out[j, 2, 0] * px + frames_out[j, 2, 1] * py + frames_out[j, 2, 2] * pz)
        )


@kernel
def copy_chain_rotations(chain_joints, frames, rotations_out):
    """Copies the rotation of the joint that carries each chain.

    Reads: chain_joints (chains,); frames (joints, 3, 4).
    Writes: rotations_out (chains, 3, 3).
    """
    for c in range(chain_joints.shape[0]):
        for a in range(3):
            for b in range(3):
                rotations_out[c, a, b] = frames[chain_joints[c], a, b]
