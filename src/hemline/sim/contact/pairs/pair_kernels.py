"""Contact in pairs along a fixed normal: cloth with itself, or a vertex of the body with cloth.

A pair has four corners with weights w, and r = sum w x. For a vertex and a triangle of the cloth, or for two edges, the
weights add up to 0, so that r is the vector between the two nearest points and n . r their distance. For a point of a
triangle above the body they add up to 1. The load grows with the square of the depth reach - n . r, so that Newton's
steps do not alternate between touching and not touching; from a depth of the thickness on it is constant. Friction is
Coulomb's smoothed potential of the slip u = (I - n n^T) (r - carried) under a lagged load. Normals, and weights of
cloth with cloth, are updated in each Newton step.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, UInt

from hemline.compiled import kernel, prange
from hemline.sim.cloth.rows import Rows
from hemline.sim.contact.body.load_kernels import press_terms, slip_terms
from hemline.sim.contact.body.touch_kernels import closest_on_triangle
from hemline.sim.solver.conjugate_kernels import FEW_PAIRS

from .pair_search_kernels import closest_on_edges

PAIR_CHUNK = 64
"""Pairs in one partial sum: fixed, so that sums do not depend on the number of threads."""


class PairRows(NamedTuple):
    """Pairs of one kind.

    Attributes:
        corners: Four vertices of each pair, uint32.
        weights: Weights of the corners: r = sum w x. They add up to 0 for cloth on cloth, where r is the vector between
            the nearest points, and to 1 where a point of the cloth touches the body.
        normal: Unit normals.
        reach: Contact begins where n . r falls below this length [m].
        carried: Value of r without slip [m].
        thickness: Depth below `reach` over which the load grows [m].
        stiffness: Contact stiffness [N/m].
        limit: Friction that each pair can bear, from its load at the start of the step [N].
    """

    corners: UInt[np.ndarray, "pairs 4"]
    weights: Float[np.ndarray, "pairs 4"]
    normal: Float[np.ndarray, "pairs 3"]
    reach: Float[np.ndarray, " pairs"]
    carried: Float[np.ndarray, "pairs 3"]
    thickness: Float[np.ndarray, " pairs"]
    stiffness: Float[np.ndarray, " pairs"]
    limit: Float[np.ndarray, " pairs"]

    @property
    def size(self) -> int:
        """Number of pairs."""
        return len(self.corners)


@kernel(inline="always")
def _along(x, corner, weight, axis):
    """Computes one coordinate of r = sum w x.

    Reads: x (verts, 3) [m]; corner, weight (4,): vertices of a pair, and their weights; axis.
    Returns: The coordinate [m].
    """
    return (
        weight[0] * x[corner[0], axis]
        + weight[1] * x[corner[1], axis]
        + weight[2] * x[corner[2], axis]
        + weight[3] * x[corner[3], axis]
    )


@kernel(parallel=True)
def pair_geometry(x, start, corners, before, weights_out, normal_out, distance_out, carried_out):
    """Computes the nearest points of each pair, and the unit normal from the second point to the first.

    A normal that turned by more than 90 degrees means that the pair went through itself. Within both elements the old
    side is kept, at their rims the old normal.

    Reads: x, start (verts, 3): positions, and those at the start of the step [m]; corners (pairs, 5): four vertices, 1
        for edges; before (pairs, 3): the normal until now, 0 for none.
    Writes: weights_out (pairs, 4); normal_out (pairs, 3); distance_out (pairs,): along the normal, negative on the
        wrong side; carried_out (pairs, 3): the vector between the same points at the start.
    """
    for p in prange(corners.shape[0]):
        a, b, c, d = corners[p, 0], corners[p, 1], corners[p, 2], corners[p, 3]
        weight = weights_out[p]
        if corners[p, 4] == 0:
            v, w, _ = closest_on_triangle(x[a, 0], x[a, 1], x[a, 2], x[b], x[c], x[d])
            weight[0], weight[1], weight[2], weight[3] = 1.0, v + w - 1.0, -v, -w
            inner = v > 0.0 and w > 0.0 and v + w < 1.0
        else:
            s, t, _ = closest_on_edges(x[a], x[b], x[c], x[d])
            weight[0], weight[1], weight[2], weight[3] = 1.0 - s, s, t - 1.0, -t
            inner = 0.0 < s < 1.0 and 0.0 < t < 1.0
        r0, r1, r2 = (
            _along(x, corners[p], weight, 0),
            _along(x, corners[p], weight, 1),
            _along(x, corners[p], weight, 2),
        )
        for axis in range(3):
            carried_out[p, axis] = _along(start, corners[p], weight, axis)
        length = (r0 * r0 + r1 * r1 + r2 * r2) ** 0.5
        n0, n1, n2 = before[p, 0], before[p, 1], before[p, 2]
        along = n0 * r0 + n1 * r1 + n2 * r2
        if length > 1e-9:
            over = 1.0 / length
            if along >= 0.0:
                n0, n1, n2 = over * r0, over * r1, over * r2
            elif inner:
                n0, n1, n2 = -over * r0, -over * r1, -over * r2
        normal_out[p, 0], normal_out[p, 1], normal_out[p, 2] = n0, n1, n2
        distance_out[p] = n0 * r0 + n1 * r1 + n2 * r2


@kernel
def near_rows(distance, margin, pairs: PairRows, out: PairRows):
    """Selects the pairs that are closer than their thickness and a margin.

    Reads: distance (pairs,) [m]; margin [m]; pairs, whose reach is their thickness.
    Writes: out: all but the reach, with room for all pairs.
    Returns: The number of pairs.
    """
    corners, weights, normal, _, carried, thickness, stiffness, limit = pairs
    corners_out, weights_out, normal_out, _, carried_out, thickness_out, stiffness_out, limit_out = out
    count = 0
    for p in range(distance.shape[0]):
        if distance[p] < thickness[p] + margin:
            for c in range(4):
                corners_out[count, c], weights_out[count, c] = corners[p, c], weights[p, c]
            for c in range(3):
                normal_out[count, c], carried_out[count, c] = normal[p, c], carried[p, c]
            thickness_out[count], stiffness_out[count], limit_out[count] = thickness[p], stiffness[p], limit[p]
            count += 1
    return count


@kernel(parallel=True)
def pair_forces(x, pairs: PairRows, creep, force_out, energy_out):
    """Computes the gradient of each pair over r, and the energy by chunk.

    Reads: x (verts, 3) [m]; pairs; creep: slip below which friction is smoothed [m].
    Writes: force_out (pairs, 3) [N]; energy_out (chunks,) [J].
    """
    corners, weights, normal, reach, carried, thickness, stiffness, limit = pairs
    count = corners.shape[0]
    for chunk in prange(energy_out.shape[0]):
        energy = 0.0
        for p in range(chunk * PAIR_CHUNK, min(count, (chunk + 1) * PAIR_CHUNK)):
            n0, n1, n2 = normal[p, 0], normal[p, 1], normal[p, 2]
            depth = reach[p] - _along(x, corners[p], weights[p], 0) * n0
            depth -= _along(x, corners[p], weights[p], 1) * n1 + _along(x, corners[p], weights[p], 2) * n2
            value, load, _ = press_terms(depth, stiffness[p], thickness[p])
            energy += value
            f0, f1, f2 = -load * n0, -load * n1, -load * n2
            if limit[p] > 0.0:
                u0, u1, u2 = _slip(x, carried[p], corners[p], weights[p], n0, n1, n2)
                value, over = slip_terms((u0 * u0 + u1 * u1 + u2 * u2) ** 0.5, creep)
                energy += limit[p] * value
                f0 += limit[p] * over * u0
                f1 += limit[p] * over * u1
                f2 += limit[p] * over * u2
            force_out[p, 0], force_out[p, 1], force_out[p, 2] = f0, f1, f2
        energy_out[chunk] = energy


@kernel(inline="always")
def _slip(x, carried, corner, weight, n0, n1, n2):
    """Computes the slip of a pair across its normal.

    Reads: x (verts, 3) [m]; carried (3,): r without slip [m]; corner, weight (4,): see `_along`; n0, n1, n2: normal.
    Returns: The three coordinates of the slip [m].
    """
    u0 = _along(x, corner, weight, 0) - carried[0]
    u1 = _along(x, corner, weight, 1) - carried[1]
    u2 = _along(x, corner, weight, 2) - carried[2]
    along = u0 * n0 + u1 * n1 + u2 * n2
    return u0 - along * n0, u1 - along * n1, u2 - along * n2


@kernel(parallel=True)
def pair_blocks(x, pairs: PairRows, creep, block_out):
    """Computes the symmetric 3 x 3 block of each pair over r.

    Reads: x (verts, 3) [m]; pairs; creep: slip below which friction is smoothed [m].
    Writes: block_out: flat, nine numbers per pair [N/m].
    """
    corners, weights, normal, reach, carried, thickness, stiffness, limit = pairs
    for p in prange(corners.shape[0]):
        n0, n1, n2 = normal[p, 0], normal[p, 1], normal[p, 2]
        depth = reach[p] - _along(x, corners[p], weights[p], 0) * n0
        depth -= _along(x, corners[p], weights[p], 1) * n1 + _along(x, corners[p], weights[p], 2) * n2
        _, _, k = press_terms(depth, stiffness[p], thickness[p])
        t = 0.0
        if limit[p] > 0.0:
            u0, u1, u2 = _slip(x, carried[p], corners[p], weights[p], n0, n1, n2)
            _, over = slip_terms((u0 * u0 + u1 * u1 + u2 * u2) ** 0.5, creep)
            t = limit[p] * over
        # k n n^T + t (I - n n^T)
        b = block_out[9 * p : 9 * p + 9]
        b[0], b[4], b[8] = t + (k - t) * n0 * n0, t + (k - t) * n1 * n1, t + (k - t) * n2 * n2
        b[1] = b[3] = (k - t) * n0 * n1
        b[2] = b[6] = (k - t) * n0 * n2
        b[5] = b[7] = (k - t) * n1 * n2


@kernel(parallel=True)
def pairs_at_vertices(corners, weights, at: Rows, force, gradient_out):
    """Adds the gradients of pairs at their vertices.

    Reads: corners, weights (pairs, 4); at: pairs of each vertex, 4 pair + corner; force (pairs, 3) [N].
    Writes: gradient_out (verts, 3): increased [N].
    """
    starts, entries = at
    if corners.shape[0] <= FEW_PAIRS:
        for p in range(corners.shape[0]):
            for corner in range(4):
                i, w = corners[p, corner], weights[p, corner]
                for c in range(3):
                    gradient_out[i, c] += w * force[p, c]
        return
    for i in prange(gradient_out.shape[0]):
        for entry in range(starts[i], starts[i + 1]):
            p, w = entries[entry] // 4, weights[entries[entry] // 4, entries[entry] % 4]
            for c in range(3):
                gradient_out[i, c] += w * force[p, c]


@kernel(inline="always")
def _add_block(weight, block, out):
    """Adds a block times the square of a weight to a symmetric block of six numbers.

    Reads: weight; block (9,): by columns [N/m].
    Writes: out (6,): xx, xy, xz, yy, yz, zz, increased [N/m].
    """
    square = weight * weight
    out[0] += square * block[0]
    out[1] += square * block[1]
    out[2] += square * block[2]
    out[3] += square * block[4]
    out[4] += square * block[5]
    out[5] += square * block[8]


@kernel(parallel=True)
def pair_diagonal(corners, weights, at: Rows, block, diagonal_out):
    """Sums the contributions of pairs to the diagonal block of each vertex: xx, xy, xz, yy, yz, zz.

    Reads: corners, weights (pairs, 4); at: pairs of each vertex, 4 pair + corner; block: from `pair_blocks` [N/m].
    Writes: diagonal_out (verts, 6) [N/m].
    """
    starts, entries = at
    if corners.shape[0] <= FEW_PAIRS:
        diagonal_out[:] = 0.0
        for p in range(corners.shape[0]):
            for corner in range(4):
                _add_block(weights[p, corner], block[9 * p : 9 * p + 9], diagonal_out[corners[p, corner]])
        return
    for i in prange(diagonal_out.shape[0]):
        for c in range(6):
            diagonal_out[i, c] = 0.0
        for entry in range(starts[i], starts[i + 1]):
            p = entries[entry] // 4
            _add_block(weights[p, entries[entry] % 4], block[9 * p : 9 * p + 9], diagonal_out[i])


@kernel
def incidence_of_pairs(corners, starts_out, entries_out):
    """Sorts pairs by vertex: vertex i has entries[starts[i]:starts[i + 1]], each 4 pair + corner.

    Reads: corners (pairs, 4).
    Writes: starts_out (verts + 2,); entries_out (4 pairs,).
    """
    count = starts_out.shape[0] - 2
    starts_out[:] = 0
    for p in range(corners.shape[0]):
        for c in range(4):
            starts_out[corners[p, c] + 2] += 1
    for i in range(2, count + 2):
        starts_out[i] += starts_out[i - 1]
    for p in range(corners.shape[0]):
        for c in range(4):
            i = corners[p, c]
            entries_out[starts_out[i + 1]] = 4 * p + c
            starts_out[i + 1] += 1


__all__ = [
    "PAIR_CHUNK",
    "PairRows",
    "incidence_of_pairs",
    "near_rows",
    "pair_blocks",
    "pair_diagonal",
    "pair_forces",
    "pair_geometry",
    "pairs_at_vertices",
]
