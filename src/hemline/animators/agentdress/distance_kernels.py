"""Distances from one pose to many, region by region, and what they make of the basis, compiled."""

import math

import numpy as np

from hemline.compiled import kernel

_ONE = np.float32(1)
_A, _B, _C = np.float32(1.5707963050), np.float32(-0.2145988016), np.float32(0.0889789874)
_D, _E, _F = np.float32(-0.0501743046), np.float32(0.0308918810), np.float32(-0.0170881256)
_G, _H = np.float32(0.0066700901), np.float32(-0.0012624911)


@kernel(forceinline=True)
def without_heading(w, x, y, z):
    """A rotation without its turn about the vertical: (w, 0, y, 0), scaled to length one, inverse, times it."""
    length = math.sqrt(w * w + y * y)
    if length < 1e-9:
        return w, x, y, z
    c, s = w / length, y / length
    return c * w + s * y, c * x - s * z, c * y - s * w, c * z + s * x


@kernel(fastmath={"reassoc", "contract"})
def pose_distances(turns, influence, joints, query, distances_out):
    # model: turns (counting, 4, poses): inverse unit quaternions of the joints that count in some region;
    #     influence (regions, 3 joints): weights of the angles; joints (counting,): which they are
    # in: query (joints, 4), wherever its root heads   out: distances_out (regions, poses)
    # sum over joints and axes of influence times the square of log(R_s^T R), twice the half angle along the axis. With
    # c the cosine of the half angle, acos(c) = sqrt(1 - c) p(c) and the sine is sqrt(1 - c) sqrt(1 + c): the square of
    # the one over the other has no root, and nothing is lost near 0. p: Abramowitz and Stegun 4.4.46, to 2e-8
    root = without_heading(query[0, 0], query[0, 1], query[0, 2], query[0, 3])
    poses = turns.shape[2]
    squares = np.empty((3, poses), np.float32)
    distances_out[:] = 0
    for k in range(joints.shape[0]):
        j = joints[k]
        e, f, g, h = np.float32(query[j, 0]), np.float32(query[j, 1]), np.float32(query[j, 2]), np.float32(query[j, 3])
        if j == 0:
            e, f, g, h = np.float32(root[0]), np.float32(root[1]), np.float32(root[2]), np.float32(root[3])
        for s in range(poses):
            a, b, c, d = turns[k, 0, s], turns[k, 1, s], turns[k, 2, s], turns[k, 3, s]
            x = a * f + b * e + c * h - d * g
            y = a * g - b * h + c * e + d * f
            z = a * h + b * g - c * f + d * e
            c = min(abs(a * e - b * f - c * g - d * h), _ONE)
            p = _A + c * (_B + c * (_C + c * (_D + c * (_E + c * (_F + c * (_G + c * _H))))))
            factor = np.float32(4) * p * p / (_ONE + c)
            squares[0, s], squares[1, s], squares[2, s] = factor * x * x, factor * y * y, factor * z * z
        for region in range(influence.shape[0]):
            p, q, r = influence[region, 3 * j], influence[region, 3 * j + 1], influence[region, 3 * j + 2]
            for s in range(poses):
                distances_out[region, s] += p * squares[0, s] + q * squares[1, s] + r * squares[2, s]


@kernel(fastmath={"reassoc", "contract"})
def mix(pose_shares, pose_weights, shape_shares, effects, modes, scales, mixed_out):
    # model: pose_weights (regions, poses, pose_modes); modes, scales (columns,): the mode of each column of the basis,
    #     and its unit [m]
    # in: pose_shares (regions, poses), none where the pose model is not asked; shape_shares (regions, anchors): what
    #     each counts for; effects (shape_regions, anchors, shape_modes)   out: mixed_out (regions, columns) [m]
    # by region: the sums of weights and effects; in float64, as the weights of poses are large and of both signs
    pose_modes, shape_modes = pose_weights.shape[2], effects.shape[2]
    found = np.empty(pose_modes + shape_modes)
    for g in range(mixed_out.shape[0]):
        found[:] = 0
        for s in range(pose_shares.shape[1]):
            share = pose_shares[g, s]
            for k in range(pose_modes):
                found[k] += share * pose_weights[g, s, k]
        told = effects[min(g, effects.shape[0] - 1)]
        for s in range(shape_shares.shape[1]):
            share = shape_shares[g, s]
            if share != 0:
                for k in range(shape_modes):
                    found[pose_modes + k] += share * told[s, k]
        for column in range(len(modes)):
            mixed_out[g, column] = found[modes[column]] * scales[column]
