"""Conjugate gradients on 3 x 3 blocks, preconditioned on two levels: float32 storage, float64 sums in fixed order.

The preconditioner adds the inverses of the diagonal blocks and a coarse correction that moves whole clusters of
vertices: M = D^-1 + P (P^T A P)^-1 P^T, with P constant on each cluster. The coarse matrix is banded and factorised for
every system.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from hemline.compiled import kernel, prange

from .block_kernels import add_pairs, advance, pair_product, row_product, turn
from .layout import Pattern

FAST = {"contract", "nsz", "arcp"}

FEW_PAIRS = 200
"""Up to this number of pairs, one thread is faster than several."""


class Matrix(NamedTuple):
    """The Hessian by slots, without pairs; blocks of nine numbers, flat float32, by columns, see `block_kernels`.

    Attributes:
        blocks: One block for each entry of the layout's ring.
        diagonal: One block for each slot.
        inverse: Inverse of each diagonal block, with pairs; 0 for fixed vertices.
    """

    blocks: Float[np.ndarray, " entries9"]
    diagonal: Float[np.ndarray, " slots9"]
    inverse: Float[np.ndarray, " slots9"]


class PairBlocks(NamedTuple):
    """Contributions of pairs to the matrix: w w^T times a block for each pair.

    Attributes:
        corners: Slots of the four vertices of each pair.
        weights: Weights of the corners, float32.
        block: Blocks, flat, nine numbers per pair.
        starts, entries: Pairs of each vertex, 4 pair + corner; empty if there are few pairs.
        product: Working memory: a vector with an entry per pair.
    """

    corners: Int[np.ndarray, "pairs 4"]
    weights: Float[np.ndarray, "pairs 4"]
    block: Float[np.ndarray, " pairs9"]
    starts: Int[np.ndarray, " verts_and_one"]
    entries: Int[np.ndarray, " pairs4"]
    product: Float[np.ndarray, " pairs4"]


class Vectors(NamedTuple):
    """Vectors of the solver, four numbers per slot, float32: the right-hand side, the solution, and working memory."""

    right: Float[np.ndarray, " slots4"]
    solution: Float[np.ndarray, " slots4"]
    residual: Float[np.ndarray, " slots4"]
    search: Float[np.ndarray, " slots4"]
    product: Float[np.ndarray, " slots4"]


class Sums(NamedTuple):
    """Sums over each cluster: one number, twice three in float64, and four in float32."""

    partial: Float[np.ndarray, " clusters"]
    cluster: Float[np.ndarray, " clusters3"]
    coarse: Float[np.ndarray, " clusters3"]
    shift: Float[np.ndarray, " clusters4"]


@kernel(parallel=True)
def coarse_matrix(pattern: Pattern, matrix: Matrix, band_out):
    """Computes the lower half of P^T A P; entry (r, c) lies at band[r, c - r + width - 1].

    Reads: pattern; matrix.
    Writes: band_out (3 clusters, width).
    """
    _, _, begin, end, label, ring_starts, ring, far_starts, far, far_bending = pattern
    blocks, diagonal, _ = matrix
    width = band_out.shape[1]
    for cluster in prange(begin.shape[0]):
        for row in range(3 * cluster, 3 * cluster + 3):
            for c in range(width):
                band_out[row, c] = 0.0
        here = width - 1
        row = 3 * cluster
        xx = yx = yy = zx = zy = zz = 0.0
        for i in range(begin[cluster], end[cluster]):
            d = diagonal[9 * i : 9 * i + 9]
            xx += d[0]
            yx += d[1]
            yy += d[4]
            zx += d[2]
            zy += d[5]
            zz += d[8]
            for e in range(ring_starts[i], ring_starts[i + 1]):
                j, b = ring[e], blocks[9 * e : 9 * e + 9]
                if label[j] == cluster:
                    xx += b[0]
                    yx += b[1]
                    yy += b[4]
                    zx += b[2]
                    zy += b[5]
                    zz += b[8]
                elif label[j] < cluster:
                    column = 3 * label[j] - row + here
                    for r in range(3):
                        for c in range(3):
                            band_out[row + r, column + c - r] += b[3 * c + r]
            for e in range(far_starts[i], far_starts[i + 1]):
                j, w = far[e], far_bending[e]
                if label[j] == cluster:
                    xx += w
                    yy += w
                    zz += w
                elif label[j] < cluster:
                    column = 3 * label[j] - row + here
                    for r in range(3):
                        band_out[row + r, column] += w
        band_out[row, here] += xx
        band_out[row + 1, here - 1] += yx
        band_out[row + 1, here] += yy
        band_out[row + 2, here - 2] += zx
        band_out[row + 2, here - 1] += zy
        band_out[row + 2, here] += zz
        if begin[cluster] == end[cluster]:
            for r in range(3):
                band_out[row + r, here] = 1.0


@kernel(fastmath={"contract", "reassoc", "nsz"})
def factorise(band):
    """Computes the Cholesky factor of a banded matrix, in place.

    Reads: band (3 clusters, width): the matrix, see `coarse_matrix`.
    Writes: band: the factor.
    Returns: False if the matrix is not positive.
    """
    count, width = band.shape
    here = width - 1
    for r in range(count):
        first = max(0, r - here)
        for c in range(first, r + 1):
            start = max(first, c - here)
            total = band[r, c - r + here]
            a, b = band[r, start - r + here : c - r + here], band[c, start - c + here : here]
            for k in range(c - start):
                total -= a[k] * b[k]
            if c < r:
                band[r, c - r + here] = total / band[c, here]
            elif total > 0.0:
                band[r, here] = total**0.5
            else:
                return False
    return True


@kernel(fastmath={"contract", "reassoc", "nsz"})
def solve_band(band, values):
    """Solves L L^T x = values in place, three rows at once: the band holds whole blocks of three.

    Reads: band (3 clusters, width): the factor L; values (3 clusters,): the right-hand side.
    Writes: values: the solution.
    """
    count, width = band.shape
    here = width - 1
    for r in range(0, count, 3):
        one, two, three = band[r], band[r + 1], band[r + 2]
        first = max(0, r - here + 2)
        x0, x1, x2 = values[r], values[r + 1], values[r + 2]
        a, b, c, before = (
            one[first - r + here :],
            two[first - r - 1 + here :],
            three[first - r - 2 + here :],
            values[first:r],
        )
        for k in range(r - first):
            x0 -= a[k] * before[k]
            x1 -= b[k] * before[k]
            x2 -= c[k] * before[k]
        x0 /= one[here]
        x1 = (x1 - two[here - 1] * x0) / two[here]
        x2 = (x2 - three[here - 2] * x0 - three[here - 1] * x1) / three[here]
        values[r], values[r + 1], values[r + 2] = x0, x1, x2
    for r in range(count - 3, -1, -3):
        one, two, three = band[r], band[r + 1], band[r + 2]
        first = max(0, r - here + 2)
        x2 = values[r + 2] / three[here]
        x1 = (values[r + 1] - three[here - 1] * x2) / two[here]
        x0 = (values[r] - two[here - 1] * x1 - three[here - 2] * x2) / one[here]
        values[r], values[r + 1], values[r + 2] = x0, x1, x2
        a, b, c, before = (
            one[first - r + here :],
            two[first - r - 1 + here :],
            three[first - r - 2 + here :],
            values[first:r],
        )
        for k in range(r - first):
            before[k] -= a[k] * x0 + b[k] * x1 + c[k] * x2


@kernel(parallel=True, fastmath=FAST)
def conjugate_gradients(
    pattern: Pattern,
    matrix: Matrix,
    band,
    pairs: PairBlocks,
    tolerance,
    iterations,
    vectors: Vectors,
    sums: Sums,
):
    """Solves A x = right for the free vertices, which are those in clusters; the others stay 0.

    Model: A = blocks on the ring, far_bending I beyond it, diagonal, and w w^T times the block of each pair
    Reads: pattern; matrix; band: factor of the coarse matrix; pairs; vectors.right; tolerance: on sqrt(r . M r)
        relative to its start; iterations: maximum. Vectors and blocks are flat and by slots, see `layout` and
        `block_kernels`.
    Writes: vectors.solution; the rest of vectors and sums, and pairs.product, are working memory.
    Returns: The number of iterations.
    """
    vertex, begin, end = pattern.vertex, pattern.begin, pattern.end
    right, solution_out, residual_out = vectors.right, vectors.solution, vectors.residual
    search_out, product_out = vectors.search, vectors.product
    partial_out, cluster_sum_out, coarse_out, shift_out = sums.partial, sums.cluster, sums.coarse, sums.shift
    count, clusters, pair_count = solution_out.shape[0], begin.shape[0], pairs.corners.shape[0]
    alpha, old, enough = np.float32(0.0), 0.0, 0.0
    for k in prange(count):
        solution_out[k], residual_out[k], search_out[k], product_out[k] = 0.0, right[k], 0.0, 0.0
    for iteration in range(iterations + 1):
        for cluster in prange(clusters):
            total, sum0, sum1, sum2 = 0.0, 0.0, 0.0, 0.0
            for i in range(begin[cluster], end[cluster]):
                # from here on `product` holds D^-1 r, until the matrix is applied
                total += advance(i, alpha, vectors, matrix.inverse)
                sum0 += residual_out[4 * i]
                sum1 += residual_out[4 * i + 1]
                sum2 += residual_out[4 * i + 2]
            partial_out[cluster] = total
            first = 3 * cluster
            cluster_sum_out[first], cluster_sum_out[first + 1], cluster_sum_out[first + 2] = sum0, sum1, sum2
        for k in range(3 * clusters):
            coarse_out[k] = cluster_sum_out[k]
        solve_band(band, coarse_out)
        new = 0.0
        for cluster in range(clusters):
            new += partial_out[cluster]
            for axis in range(3):
                new += coarse_out[3 * cluster + axis] * cluster_sum_out[3 * cluster + axis]
                shift_out[4 * cluster + axis] = coarse_out[3 * cluster + axis]
        if iteration == 0:
            enough = tolerance * tolerance * new
        if iteration == iterations or not new > enough:
            return iteration
        beta = np.float32(0.0 if iteration == 0 else new / old)
        old = new
        for cluster in prange(clusters):
            for i in range(begin[cluster], end[cluster]):
                turn(i, cluster, beta, shift_out, vectors)
        if pair_count > FEW_PAIRS:
            for p in prange(pair_count):
                pair_product(p, pairs, search_out)
        for cluster in prange(clusters):
            total = 0.0
            for i in range(begin[cluster], end[cluster]):
                total += row_product(i, pattern, matrix, vectors)
                if pair_count > FEW_PAIRS:
                    v = vertex[i]
                    if pairs.starts[v] < pairs.starts[v + 1]:
                        total += add_pairs(i, v, pairs, vectors)
            partial_out[cluster] = total
        bend = 0.0
        for cluster in range(clusters):
            bend += partial_out[cluster]
        if pair_count <= FEW_PAIRS:
            for p in range(pair_count):
                pair_product(p, pairs, search_out)
                for c in range(4):
                    # at a fixed vertex it is added too, where nobody reads it and the search is 0
                    row, w = 4 * pairs.corners[p, c], pairs.weights[p, c]
                    for axis in range(3):
                        added = w * pairs.product[4 * p + axis]
                        product_out[row + axis] += added
                        bend += search_out[row + axis] * added
        if not bend > 0.0:
            return iteration
        alpha = np.float32(old / bend)
    return iterations


__all__ = [
    "FEW_PAIRS",
    "Matrix",
    "PairBlocks",
    "Sums",
    "Vectors",
    "coarse_matrix",
    "conjugate_gradients",
    "factorise",
    "solve_band",
]
