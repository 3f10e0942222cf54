"""The joints' frames: points into and out of them, and their way between two poses."""

import math

from hemline.compiled import kernel


@kernel
def to_rest(frames, j, x, y, z):
    x, y, z = x - frames[j, 0, 3], y - frames[j, 1, 3], z - frames[j, 2, 3]
    return (
        frames[j, 0, 0] * x + frames[j, 1, 0] * y + frames[j, 2, 0] * z,
        frames[j, 0, 1] * x + frames[j, 1, 1] * y + frames[j, 2, 1] * z,
        frames[j, 0, 2] * x + frames[j, 1, 2] * y + frames[j, 2, 2] * z,
    )


@kernel
def rotate(frames, j, x, y, z):
    return (
        frames[j, 0, 0] * x + frames[j, 0, 1] * y + frames[j, 0, 2] * z,
        frames[j, 1, 0] * x + frames[j, 1, 1] * y + frames[j, 1, 2] * z,
        frames[j, 2, 0] * x + frames[j, 2, 1] * y + frames[j, 2, 2] * z,
    )


@kernel
def to_world(frames, j, x, y, z):
    u, v, w = rotate(frames, j, x, y, z)
    return u + frames[j, 0, 3], v + frames[j, 1, 3], w + frames[j, 2, 3]


@kernel
def quaternion_of(frames, j):
    # in: frames (joints, 3, 4)   returns: w, x, y, z of the rotation of joint j
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
    for j in range(frames.shape[0]):
        for a in range(3):
            for b in range(4):
                frames_out[j, a, b] = frames[j, a, b]


@kernel
def frames_between(frames_from, frames_to, pivots, share, frames_out):
    # in: two poses of the joints, share 0..1
    # out: frames_out between them: pivots on straight lines, rotations by slerp
    if share >= 1.0:
        copy_frames(frames_to, frames_out)
        return
    for j in range(pivots.shape[0]):
        w0, x0, y0, z0 = quaternion_of(frames_from, j)
        w1, x1, y1, z1 = quaternion_of(frames_to, j)
        dot = w0 * w1 + x0 * x1 + y0 * y1 + z0 * z1
        sign = 1.0 if dot >= 0.0 else -1.0
        angle = math.acos(min(abs(dot), 1.0))
        first, second = 1.0 - share, share * sign
        if angle > 1e-6:
            first, second = (
                math.sin((1.0 - share) * angle) / math.sin(angle),
                sign * math.sin(share * angle) / math.sin(angle),
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
            ax + share * (bx - ax) - (frames_out[j, 0, 0] * px + frames_out[j, 0, 1] * py + frames_out[j, 0, 2] * pz)
        )
        frames_out[j, 1, 3] = (
            ay + share * (by - ay) - (frames_out[j, 1, 0] * px + frames_out[j, 1, 1] * py + frames_out[j, 1, 2] * pz)
        )
        frames_out[j, 2, 3] = (
            az + share * (bz - az) - (frames_out[j, 2, 0] * px + frames_out[j, 2, 1] * py + frames_out[j, 2, 2] * pz)
        )


@kernel
def turn_chains(chain_joints, frames, chain_frames_out):
    for c in range(chain_joints.shape[0]):
        for a in range(3):
            for b in range(3):
                chain_frames_out[c, a, b] = frames[chain_joints[c], a, b]
