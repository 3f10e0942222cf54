"""Compiled distances from one pose to many, per region, and the basis coefficients that follow from them."""

import math

import numpy as np

from hemline.compiled import kernel


@kernel(forceinline=True)
def without_heading(w, x, y, z):
    """Removes the heading of a rotation: multiplies it by the inverse of the normalised (w, 0, y, 0).

    Reads: w, x, y, z: of unit length.
    Returns: w, x, y, z without the heading.
    """
    length = math.sqrt(w * w + y * y)
    if length < 1e-9:
        return w, x, y, z
    c, s = w / length, y / length
    return c * w + s * y, c * x - s * z, c * y - s * w, c * z + s * x


@kernel
def matrix_columns(w, x, y, z, axes_out):
    """Converts a quaternion to a matrix.

    Reads: w, x, y, z: of unit length.
    Writes: axes_out (9,): the columns of the matrix.
    """
    axes_out[0], axes_out[1], axes_out[2] = 1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)
    axes_out[3], axes_out[4], axes_out[5] = 2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)
    axes_out[6], axes_out[7], axes_out[8] = 2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)


@kernel
def pose_axes(joints, query, axes_out):
    """Computes the axes of the joints that count, without the heading of the body.

    Reads: joints (counting,): joints that count in some region; query (joints, 4): rotations with any heading, wxyz.
    Writes: axes_out (counting, 9).
    """
    for k in range(joints.shape[0]):
        j = joints[k]
        w, x, y, z = query[j, 0], query[j, 1], query[j, 2], query[j, 3]
        if j == 0:
            w, x, y, z = without_heading(w, x, y, z)
        matrix_columns(w, x, y, z, axes_out[k])


@kernel(fastmath={"reassoc", "contract"})
def axes_distances(known, weights, joints, axes, distances_out):
    """Measures a pose against many: the sum over joints and axes of weight times squared distance of the axes.

    Reads: known (counting, 9, poses): axes of the joints that count in some region; weights (regions, 3 joints) of the
        axes; joints (counting,): indices of these joints; axes (counting, 9).
    Writes: distances_out (regions, poses).
    """
    poses = known.shape[2]
    squares = np.empty((3, poses), np.float32)
    distances_out[:] = 0
    for k in range(joints.shape[0]):
        j = joints[k]
        for c in range(3):
            a, b, d = axes[k, 3 * c], axes[k, 3 * c + 1], axes[k, 3 * c + 2]
            for s in range(poses):
                e, f, g = known[k, 3 * c, s] - a, known[k, 3 * c + 1, s] - b, known[k, 3 * c + 2, s] - d
                squares[c, s] = e * e + f * f + g * g
        for region in range(weights.shape[0]):
            p, q, r = weights[region, 3 * j], weights[region, 3 * j + 1], weights[region, 3 * j + 2]
            for s in range(poses):
                distances_out[region, s] += p * squares[0, s] + q * squares[1, s] + r * squares[2, s]


@kernel(forceinline=True)
def add_rows(weights, rows, sums_out):
    """Adds weighted rows, four at a time, so that sums stay in registers; four rows of weight 0 are not read.

    Reads: weights (rows,); rows (rows, modes).
    Writes: sums_out (modes,), float64: increased.
    """
    whole = len(weights) // 4 * 4
    for s in range(0, whole, 4):
        a, b, c, d = weights[s], weights[s + 1], weights[s + 2], weights[s + 3]
        if a == 0 and b == 0 and c == 0 and d == 0:
            continue
        one, two, three, four = rows[s], rows[s + 1], rows[s + 2], rows[s + 3]
        for k in range(len(sums_out)):
            sums_out[k] += a * one[k] + b * two[k] + c * three[k] + d * four[k]
    for s in range(whole, len(weights)):
        weight, row = weights[s], rows[s]
        for k in range(len(sums_out)):
            sums_out[k] += weight * row[k]


@kernel(fastmath={"reassoc", "contract"})
def mix(pose_kernel, pose_weights, shape_kernel, effects, modes, scales, coefficients_out):
    """Mixes the basis coefficients of each region, in float64, as the weights of poses are large and of both signs.

    Reads: pose_kernel (regions, poses), without poses if the pose model is not used; pose_weights (regions, poses,
        pose_modes); shape_kernel (regions, anchors): weights of the anchors; effects (shape_regions, anchors,
        shape_modes); modes, scales (columns,): the mode of each column of the basis, and its unit [m].
    Writes: coefficients_out (regions, columns) [m].
    """
    pose_modes, shape_modes = pose_weights.shape[2], effects.shape[2]
    sums = np.empty(pose_modes + shape_modes)
    for g in range(coefficients_out.shape[0]):
        sums[:] = 0
        add_rows(pose_kernel[g], pose_weights[g], sums[:pose_modes])
        add_rows(shape_kernel[g], effects[min(g, effects.shape[0] - 1)], sums[pose_modes:])
        for column in range(len(modes)):
            coefficients_out[g, column] = sums[modes[column]] * scales[column]
