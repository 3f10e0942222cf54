"""Distances from one pose to many, region by region, compiled."""

import math

from hemline.compiled import kernel


@kernel(forceinline=True)
def without_heading(w, x, y, z):
    """A rotation without its turn about the vertical: (w, 0, y, 0), scaled to length one, inverse, times it."""
    length = math.sqrt(w * w + y * y)
    if length < 1e-9:
        return w, x, y, z
    c, s = w / length, y / length
    return c * w + s * y, c * x - s * z, c * y - s * w, c * z + s * x


@kernel
def pose_distances(rotations, influence, joints, query, distances_out):
    # model: rotations (poses, joints, 4): unit quaternions; influence (regions, 3 joints): weights of the angles;
    #     joints: those that count in some region
    # in: query (joints, 4), wherever its root heads   out: distances_out (regions, poses)
    # sum over joints and axes of influence times the square of log(R_s^T R), twice the half angle along the axis
    root = without_heading(query[0, 0], query[0, 1], query[0, 2], query[0, 3])
    for s in range(rotations.shape[0]):
        for g in range(influence.shape[0]):
            distances_out[g, s] = 0.0
        for k in range(joints.shape[0]):
            j = joints[k]
            a, b, c, d = rotations[s, j, 0], -rotations[s, j, 1], -rotations[s, j, 2], -rotations[s, j, 3]
            e, f, g_, h = query[j, 0], query[j, 1], query[j, 2], query[j, 3]
            if j == 0:
                e, f, g_, h = root
            w = a * e - b * f - c * g_ - d * h
            x = a * f + b * e + c * h - d * g_
            y = a * g_ - b * h + c * e + d * f
            z = a * h + b * g_ - c * f + d * e
            sine = math.sqrt(x * x + y * y + z * z)
            factor = 2.0 if sine < 1e-9 else 2.0 * math.atan2(sine, abs(w)) / sine
            x, y, z = (factor * x) ** 2, (factor * y) ** 2, (factor * z) ** 2
            for g in range(influence.shape[0]):
                distances_out[g, s] += (
                    influence[g, 3 * j] * x + influence[g, 3 * j + 1] * y + influence[g, 3 * j + 2] * z
                )
