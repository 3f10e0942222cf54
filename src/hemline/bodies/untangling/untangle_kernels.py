"""Compiled kernels of `untangling`: the Gauss-Newton system of overlapping balls."""

import numpy as np

from hemline.compiled import kernel


@kernel
def deepest_overlaps(centres, radii, pairs, limb_pairs, deepest_out):
    """Computes the deepest overlap of each pair of limbs, 0 where there is none.

    # in:  centres (balls, 3) posed [m], radii (balls,) [m], pairs (pairs, 2), limb_pairs (pairs,)
    # out: deepest_out (limb pairs,) [m]
    """
    deepest_out[:] = 0
    for k in range(len(pairs)):
        a, b = pairs[k, 0], pairs[k, 1]
        reach = radii[a] + radii[b]
        x, y, z = centres[a, 0] - centres[b, 0], centres[a, 1] - centres[b, 1], centres[a, 2] - centres[b, 2]
        square = x * x + y * y + z * z
        if square < reach * reach:
            deepest_out[limb_pairs[k]] = max(deepest_out[limb_pairs[k]], reach - np.sqrt(square))


@kernel
def add_overlaps(
    centres, radii, pairs, limb_pairs, gaps, ramp, joints, axes, shares, scales, matrix_out, vector_out, columns_out
):
    r"""Adds J^T J and J^T f of all overlaps, f = d^2 / (2 s) up to the ramp s and d - s/2 beyond, d = reach - distance.

    # in:  centres (balls, 3) posed [m], radii (balls,) [m], pairs (pairs, 2), limb_pairs (pairs,); gaps (limb pairs,)
    #      to keep [m]; ramp s [m]; joints (joints, 3) that may turn [m], axes (joints, 3, 3) in the world, shares
    #      (balls, joints): how much each ball moves with each joint; scales (joints,) of the columns
    # out: matrix_out (3 joints, 3 joints) and vector_out (3 joints,), added to; columns_out (3 joints,), scratch
    """
    count = len(joints)
    for k in range(len(pairs)):
        a, b = pairs[k, 0], pairs[k, 1]
        reach = radii[a] + radii[b] + gaps[limb_pairs[k]]
        x, y, z = centres[a, 0] - centres[b, 0], centres[a, 1] - centres[b, 1], centres[a, 2] - centres[b, 2]
        square = x * x + y * y + z * z
        if square >= reach * reach or square < 1e-12:
            continue
        distance = np.sqrt(square)
        depth = reach - distance
        residual = depth * depth / (2 * ramp) if depth < ramp else depth - ramp / 2
        slope = min(depth / ramp, 1.0)
        for j in range(count):
            for c in range(3):
                ux, uy, uz = axes[j, 0, c], axes[j, 1, c], axes[j, 2, c]
                change = 0.0
                for ball, sign in ((a, -1.0), (b, 1.0)):
                    moves_with = shares[ball, j]
                    if moves_with > 0:
                        px = centres[ball, 0] - joints[j, 0]
                        py = centres[ball, 1] - joints[j, 1]
                        pz = centres[ball, 2] - joints[j, 2]
                        moved = (uy * pz - uz * py) * x + (uz * px - ux * pz) * y + (ux * py - uy * px) * z
                        change += sign * moves_with * moved / distance
                columns_out[3 * j + c] = slope * scales[j] * change
        for row in range(3 * count):
            if columns_out[row] == 0:
                continue
            vector_out[row] += columns_out[row] * residual
            for column in range(3 * count):
                if columns_out[column] == 0:
                    continue
                matrix_out[row, column] += columns_out[row] * columns_out[column]
