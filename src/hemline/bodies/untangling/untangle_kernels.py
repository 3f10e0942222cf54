"""Compiled kernels of `untangling`: the Gauss-Newton system of overlapping balls."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from hemline.compiled import kernel

RAMP = 0.005
"""Depth of an overlap up to which its cost grows faster than the depth [m]."""


class PosedBalls(NamedTuple):
    """The balls that fill the limbs of a posed body, see `Balls`."""

    centres: Float[np.ndarray, "balls 3"]
    """Centres in the pose [m]."""
    radii: Float[np.ndarray, " balls"]
    """Radii [m]."""
    pairs: Int[np.ndarray, "pairs 2"]
    """Pairs of balls that must not overlap."""
    limb_pairs: Int[np.ndarray, " pairs"]
    """Pair of limbs that each pair of balls belongs to."""


class TurningJoints(NamedTuple):
    """The joints of a posed body that may turn."""

    positions: Float[np.ndarray, "joints 3"]
    """Positions in the pose [m]."""
    axes: Float[np.ndarray, "joints 3 3"]
    """Axes of the turns, as columns, in the world."""
    shares: Float[np.ndarray, "balls joints"]
    """Fraction of each joint's turn that moves each ball."""
    scales: Float[np.ndarray, " joints"]
    """Turn of a joint per unit of its free parameter."""


@kernel
def deepest_overlaps(balls: PosedBalls, deepest_out):
    """Computes the deepest overlap of each pair of limbs, 0 where there is none.

    Reads: balls.
    Writes: deepest_out (limb pairs,) [m].
    """
    centres, radii, pairs, limb_pairs = balls
    deepest_out[:] = 0
    for k in range(len(pairs)):
        a, b = pairs[k, 0], pairs[k, 1]
        reach = radii[a] + radii[b]
        x, y, z = centres[a, 0] - centres[b, 0], centres[a, 1] - centres[b, 1], centres[a, 2] - centres[b, 2]
        square = x * x + y * y + z * z
        if square < reach * reach:
            deepest_out[limb_pairs[k]] = max(deepest_out[limb_pairs[k]], reach - np.sqrt(square))


@kernel
def add_overlaps(balls: PosedBalls, turning: TurningJoints, gaps, matrix_out, vector_out):
    """Adds J^T J and J^T f of all overlaps, f = d^2 / (2 s) up to s = `RAMP` and d - s/2 beyond, d = reach - distance.

    Reads: balls; turning; gaps (limb pairs,) to keep [m].
    Writes: matrix_out (3 joints, 3 joints), vector_out (3 joints,): increased.
    """
    centres, radii, pairs, limb_pairs = balls
    joints, axes, shares, scales = turning
    count, ramp = len(joints), RAMP
    columns = np.empty(3 * count)
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
                columns[3 * j + c] = slope * scales[j] * change
        for row in range(3 * count):
            if columns[row] == 0:
                continue
            vector_out[row] += columns[row] * residual
            for column in range(3 * count):
                if columns[column] == 0:
                    continue
                matrix_out[row, column] += columns[row] * columns[column]
