"""Compiled solver for skin weights that reproduce simulated derivatives."""

import numpy as np

from hemline.compiled import kernel

LEAST_SLOPE = 1e-9
"""Descent of the cost, relative to the cost of all joints, above which a bone becomes active."""

RIDGE = 1e-12
"""Regularisation of the diagonal, relative to its largest entry, for indistinguishable bones."""


@kernel(forceinline=True)
def minimize_free(hessian, linear, bones, count, factor, result_out):
    """Minimizes w^T H w / 2 - l^T w over the weights of some bones that sum to 1.

    Model: H = L L^T, w = H^-1 (l - slope 1), where the slope makes the weights sum to 1

    Reads: hessian (joints, joints): H; linear (joints,): l; bones[:count]: the bones.
    Writes: factor (joints, joints): L, working memory; result_out (2, joints): the weights in row 0.
    Returns: the slope, the multiplier of the sum.
    """
    for i in range(count):
        for j in range(i + 1):
            total = hessian[bones[i], bones[j]]
            for k in range(j):
                total -= factor[i, k] * factor[j, k]
            factor[i, j] = np.sqrt(max(total, 1e-300)) if i == j else total / factor[j, j]
    total_linear, total_ones = 0.0, 0.0
    for side in range(2):
        for i in range(count):
            total = linear[bones[i]] if side == 0 else 1.0
            for k in range(i):
                total -= factor[i, k] * result_out[side, k]
            result_out[side, i] = total / factor[i, i]
        for i in range(count - 1, -1, -1):
            total = result_out[side, i]
            for k in range(i + 1, count):
                total -= factor[k, i] * result_out[side, k]
            result_out[side, i] = total / factor[i, i]
    for i in range(count):
        total_linear += result_out[0, i]
        total_ones += result_out[1, i]
    slope = (total_linear - 1.0) / total_ones
    for i in range(count):
        result_out[0, i] -= slope * result_out[1, i]
    return slope


@kernel
def minimize_on_simplex(squares, linear, stiffness, parents, common, allowed, weights_out):
    """Minimizes w^T H w / 2 - l^T w over weights >= 0 that sum to 1, exactly, by active sets.

    Model: H_bc = sum of squares of all joints that move b and c, plus the stiffness on the diagonal

    Reads: squares, linear (verts, joints); stiffness (verts,); parents (joints,), each before its children; common
        (joints, joints): the last joint that moves both; allowed (verts, joints); weights_out: start values that are
        0 where not allowed and sum to 1.
    Writes: weights_out (verts, joints): changed.

    Source: Lawson, Hanson, "Solving least squares problems", 1974.
    """
    joints = len(parents)
    carried, hessian, factor = np.empty(joints), np.empty((joints, joints)), np.empty((joints, joints))
    bones, least = np.empty(joints, np.int64), np.empty((2, joints))
    for v in range(len(weights_out)):
        weights = weights_out[v]
        for j in range(joints):
            carried[j] = squares[v, j] + (carried[parents[j]] if j > 0 else 0.0)
        largest = carried.max() + stiffness[v]
        for b in range(joints):
            for c in range(joints):
                hessian[b, c] = carried[common[b, c]]
            hessian[b, b] += stiffness[v] + RIDGE * largest
        count = 0
        for b in range(joints):
            if weights[b] > 0:
                bones[count] = b
                count += 1
        for _ in range(joints * joints):
            slope = minimize_free(hessian, linear[v], bones, count, factor, least)
            reach = 1.0
            for i in range(count):
                if least[0, i] < 0:
                    reach = min(reach, weights[bones[i]] / (weights[bones[i]] - least[0, i]))
            left = 0
            for i in range(count):
                b = bones[i]
                weights[b] += reach * (least[0, i] - weights[b])
                if least[0, i] < 0 and weights[b] < 1e-14:
                    weights[b] = 0.0
                else:
                    bones[left] = b
                    left += 1
            count = left
            if reach < 1.0:
                continue
            best, steepest = -1, -LEAST_SLOPE * largest
            for b in range(joints):
                if allowed[v, b] and weights[b] == 0:
                    falls = slope - linear[v, b]
                    for i in range(count):
                        falls += hessian[b, bones[i]] * weights[bones[i]]
                    if falls < steepest:
                        best, steepest = b, falls
            if best < 0:
                break
            bones[count] = best
            count += 1
