"""Conjugate gradients on 3 x 3 blocks, preconditioned on two levels: float32 storage, float64 sums in fixed order.

The preconditioner adds the inverses of the diagonal blocks and a coarse correction that moves whole patches of
vertices: M = D^-1 + P (P^T A P)^-1 P^T, with P constant on each patch. The coarse matrix is banded and factorised
anew for every system.
"""

import numpy as np

from hemline.compiled import kernel, prange

from .block_kernels import block_product, row_product

CHUNK = 128
FAST = {"contract", "nsz", "arcp"}


@kernel(parallel=True)
def coarse_matrix(
    member_starts, members, label, ring_starts, ring, blocks, far_starts, far, far_bending, diagonal, band_out
):
    """P^T A P, lower half: entry (r, c) lies at band[r, c - r + width - 1]."""
    width = band_out.shape[1]
    for patch in prange(member_starts.shape[0] - 1):
        for row in range(3 * patch, 3 * patch + 3):
            for c in range(width):
                band_out[row, c] = 0.0
        here = width - 1
        row = 3 * patch
        xx = yx = yy = zx = zy = zz = 0.0
        for entry in range(member_starts[patch], member_starts[patch + 1]):
            i = members[entry]
            d = diagonal[9 * i : 9 * i + 9]
            xx += d[0]
            yx += d[1]
            yy += d[4]
            zx += d[2]
            zy += d[5]
            zz += d[8]
            for e in range(ring_starts[i], ring_starts[i + 1]):
                j, b = ring[e], blocks[9 * e : 9 * e + 9]
                if label[j] == patch:
                    xx += b[0]
                    yx += b[1]
                    yy += b[4]
                    zx += b[2]
                    zy += b[5]
                    zz += b[8]
                elif label[j] < patch:
                    column = 3 * label[j] - row + here
                    for r in range(3):
                        for c in range(3):
                            band_out[row + r, column + c - r] += b[3 * c + r]
            for e in range(far_starts[i], far_starts[i + 1]):
                j, w = far[e], far_bending[e]
                if label[j] == patch:
                    xx += w
                    yy += w
                    zz += w
                elif label[j] < patch:
                    column = 3 * label[j] - row + here
                    for r in range(3):
                        band_out[row + r, column] += w
        band_out[row, here] += xx
        band_out[row + 1, here - 1] += yx
        band_out[row + 1, here] += yy
        band_out[row + 2, here - 2] += zx
        band_out[row + 2, here - 1] += zy
        band_out[row + 2, here] += zz
        if member_starts[patch] == member_starts[patch + 1]:
            for r in range(3):
                band_out[row + r, here] = 1.0


@kernel(fastmath={"contract", "reassoc", "nsz"})
def factorise(band):
    """Cholesky factor of a banded matrix, in place; False if it is not positive."""
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
    """Solve L L^T x = values in place."""
    count, width = band.shape
    here = width - 1
    for r in range(count):
        first = max(0, r - here)
        total, a, b = 0.0, band[r, first - r + here : here], values[first:r]
        for k in range(r - first):
            total += a[k] * b[k]
        values[r] = (values[r] - total) / band[r, here]
    for r in range(count - 1, -1, -1):
        x = values[r] / band[r, here]
        values[r] = x
        first = max(0, r - here)
        a, b = band[r, first - r + here : here], values[first:r]
        for k in range(r - first):
            b[k] -= a[k] * x


@kernel(parallel=True, fastmath=FAST)
def conjugate_gradients(
    ring_starts, ring, blocks, far_starts, far, far_bending, diagonal, inverse, member_starts, members, label,
    band, pair_corners, pair_weights, pair_block, pair_starts, pair_entries, pair_product, right, tolerance, iterations,
    solution_out, residual_out, search_out, product_out, partial_out, patch_sum_out, coarse_out,
):  # fmt: skip
    """Solve A x = right for the free vertices; the others, whose inverse is 0, stay 0.

    # model: A = blocks on the ring, far_bending I beyond it, diagonal, and of each pair w w^T times its block;
    #      band = factor of the coarse matrix
    # in:  label: patch of each vertex, one past the last for fixed ones; tolerance: on sqrt(r . M r) relative to its
    #      start; iterations: at most
    # out: solution; the rest is working memory. Vectors and blocks are flat, see `block_kernels`; coarse has one patch
    #      more, which stays 0.
    # Returns the number of iterations.
    """
    count, patches = label.shape[0], member_starts.shape[0] - 1
    chunks = (count + CHUNK - 1) // CHUNK
    pairs = pair_corners.shape[0]
    alpha, old, enough = np.float32(0.0), 0.0, 0.0
    for k in prange(4 * count):
        solution_out[k], residual_out[k], search_out[k], product_out[k] = 0.0, right[k], 0.0, 0.0
    for c in range(3):
        coarse_out[3 * patches + c] = 0.0
    for iteration in range(iterations + 1):
        for chunk in prange(chunks):
            first, end, total = chunk * CHUNK, min(count, (chunk + 1) * CHUNK), 0.0
            for k in range(4 * first, 4 * end):
                solution_out[k] += alpha * search_out[k]
                residual_out[k] -= alpha * product_out[k]
            for i in range(first, end):
                # from here on `product` holds D^-1 r, until the matrix is applied
                total += block_product(inverse, i, residual_out, product_out)
            partial_out[chunk] = total
        for patch in prange(patches):
            sum0, sum1, sum2 = 0.0, 0.0, 0.0
            for entry in range(member_starts[patch], member_starts[patch + 1]):
                k = 4 * members[entry]
                sum0 += residual_out[k]
                sum1 += residual_out[k + 1]
                sum2 += residual_out[k + 2]
            patch_sum_out[3 * patch], patch_sum_out[3 * patch + 1], patch_sum_out[3 * patch + 2] = sum0, sum1, sum2
        for k in range(3 * patches):
            coarse_out[k] = patch_sum_out[k]
        solve_band(band, coarse_out)
        new = 0.0
        for chunk in range(chunks):
            new += partial_out[chunk]
        for k in range(3 * patches):
            new += coarse_out[k] * patch_sum_out[k]
        if iteration == 0:
            enough = tolerance * tolerance * new
        if iteration == iterations or not new > enough:
            return iteration
        beta = np.float32(0.0 if iteration == 0 else new / old)
        old = new
        for chunk in prange(chunks):
            for i in range(chunk * CHUNK, min(count, (chunk + 1) * CHUNK)):
                k, c = 4 * i, 3 * label[i]
                for axis in range(3):
                    z = product_out[k + axis] + np.float32(coarse_out[c + axis])
                    search_out[k + axis] = z + beta * search_out[k + axis]
        if pairs > 0:
            for p in prange(pairs):
                s0 = s1 = s2 = np.float32(0.0)
                for c in range(4):
                    k, w = 4 * pair_corners[p, c], pair_weights[p, c]
                    s0 += w * search_out[k]
                    s1 += w * search_out[k + 1]
                    s2 += w * search_out[k + 2]
                b = pair_block[6 * p : 6 * p + 6]
                pair_product[4 * p] = b[0] * s0 + b[1] * s1 + b[2] * s2
                pair_product[4 * p + 1] = b[1] * s0 + b[3] * s1 + b[4] * s2
                pair_product[4 * p + 2] = b[2] * s0 + b[4] * s1 + b[5] * s2
        for chunk in prange(chunks):
            total = 0.0
            for i in range(chunk * CHUNK, min(count, (chunk + 1) * CHUNK)):
                total += row_product(
                    i, diagonal, ring, ring_starts[i], ring_starts[i + 1], blocks, far, far_starts[i],
                    far_starts[i + 1], far_bending, search_out, product_out,
                )  # fmt: skip
                if pairs > 0 and pair_starts[i] < pair_starts[i + 1]:
                    for entry in range(pair_starts[i], pair_starts[i + 1]):
                        p = pair_entries[entry] // 4
                        w = pair_weights[p, pair_entries[entry] % 4]
                        for c in range(3):
                            product_out[4 * i + c] += w * pair_product[4 * p + c]
                            total += w * pair_product[4 * p + c] * search_out[4 * i + c]
            partial_out[chunk] = total
        bend = 0.0
        for chunk in range(chunks):
            bend += partial_out[chunk]
        if not bend > 0.0:
            return iteration
        alpha = np.float32(old / bend)
    return iterations


__all__ = ["coarse_matrix", "conjugate_gradients", "factorise", "solve_band"]
