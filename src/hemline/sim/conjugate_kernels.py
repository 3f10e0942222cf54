"""Conjugate gradients on 3 x 3 blocks, preconditioned on two levels: float32 storage, float64 sums in fixed order.

The preconditioner adds the inverses of the diagonal blocks and a coarse correction that moves whole patches of
vertices: M = D^-1 + P (P^T A P)^-1 P^T, with P constant on each patch. The coarse matrix is banded and factorised
anew for every system.
"""

import numpy as np

from hemline.compiled import kernel, prange

CHUNK = 128
FAST = {"contract", "nsz", "arcp"}


@kernel(parallel=True)
def coarse_matrix(
    member_starts, members, label, fixed, ring_starts, ring, blocks, far_starts, far, far_bending, diagonal, band_out
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
            d = diagonal[i]
            xx += d[0]
            yx += d[1]
            yy += d[3]
            zx += d[2]
            zy += d[4]
            zz += d[5]
            for e in range(ring_starts[i], ring_starts[i + 1]):
                j, b = ring[e], blocks[e]
                if fixed[j]:
                    continue
                if label[j] == patch:
                    xx += b[0]
                    yx += b[3]
                    yy += b[4]
                    zx += b[6]
                    zy += b[7]
                    zz += b[8]
                elif label[j] < patch:
                    column = 3 * label[j] - row + here
                    for r in range(3):
                        for c in range(3):
                            band_out[row + r, column + c - r] += b[3 * r + c]
            for e in range(far_starts[i], far_starts[i + 1]):
                j, w = far[e], far_bending[e]
                if fixed[j]:
                    continue
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


@kernel
def solve_band(band, values):
    """Solve L L^T x = values in place."""
    count, width = band.shape
    here = width - 1
    for r in range(count):
        total = values[r]
        for c in range(max(0, r - here), r):
            total -= band[r, c - r + here] * values[c]
        values[r] = total / band[r, here]
    for r in range(count - 1, -1, -1):
        x = values[r] / band[r, here]
        values[r] = x
        for c in range(max(0, r - here), r):
            values[c] -= band[r, c - r + here] * x


@kernel(parallel=True, fastmath=FAST)
def conjugate_gradients(
    ring_starts, ring, blocks, far_starts, far, far_bending, diagonal, inverse, member_starts, members, label, fixed,
    band, right, tolerance, iterations,
    solution_out, residual_out, search_out, product_out, partial_out, patch_partial_out, coarse_out,
):  # fmt: skip
    """Solve A x = right for the free vertices; the others stay 0.

    # model: A = blocks on the ring, far_bending I beyond it, symmetric diagonal; band = factor of the coarse matrix
    # in:  tolerance: on sqrt(r . M r) relative to its start; iterations: at most
    # out: solution; the rest is working memory. Returns the number of iterations.
    """
    count, patches = right.shape[0], member_starts.shape[0] - 1
    chunks = (count + CHUNK - 1) // CHUNK
    alpha, old, enough = np.float32(0.0), 0.0, 0.0
    for i in prange(count):
        for c in range(3):
            solution_out[i, c] = 0.0
            residual_out[i, c] = 0.0 if fixed[i] else right[i, c]
            search_out[i, c] = 0.0
            product_out[i, c] = 0.0
    for iteration in range(iterations + 1):
        # residual, its sum on each patch, its product with the fine preconditioner
        for patch in prange(patches):
            total, sum0, sum1, sum2 = 0.0, 0.0, 0.0, 0.0
            for entry in range(member_starts[patch], member_starts[patch + 1]):
                i = members[entry]
                solution_out[i, 0] += alpha * search_out[i, 0]
                solution_out[i, 1] += alpha * search_out[i, 1]
                solution_out[i, 2] += alpha * search_out[i, 2]
                r0 = residual_out[i, 0] - alpha * product_out[i, 0]
                r1 = residual_out[i, 1] - alpha * product_out[i, 1]
                r2 = residual_out[i, 2] - alpha * product_out[i, 2]
                residual_out[i, 0], residual_out[i, 1], residual_out[i, 2], m = r0, r1, r2, inverse[i]
                z0 = m[0] * r0 + m[1] * r1 + m[2] * r2
                z1 = m[1] * r0 + m[3] * r1 + m[4] * r2
                z2 = m[2] * r0 + m[4] * r1 + m[5] * r2
                product_out[i, 0], product_out[i, 1], product_out[i, 2] = z0, z1, z2
                total += r0 * z0 + r1 * z1 + r2 * z2
                sum0 += r0
                sum1 += r1
                sum2 += r2
            patch_partial_out[patch, 0] = total
            patch_partial_out[patch, 1], patch_partial_out[patch, 2], patch_partial_out[patch, 3] = sum0, sum1, sum2
        for patch in range(patches):
            for c in range(3):
                coarse_out[3 * patch + c] = patch_partial_out[patch, 1 + c]
        solve_band(band, coarse_out)
        new = 0.0
        for patch in range(patches):
            new += patch_partial_out[patch, 0]
            for c in range(3):
                new += coarse_out[3 * patch + c] * patch_partial_out[patch, 1 + c]
        if iteration == 0:
            enough = tolerance * tolerance * new
        if iteration == iterations or not new > enough:
            return iteration
        beta = np.float32(0.0 if iteration == 0 else new / old)
        old = new
        for patch in prange(patches):
            e0, e1 = np.float32(coarse_out[3 * patch]), np.float32(coarse_out[3 * patch + 1])
            e2 = np.float32(coarse_out[3 * patch + 2])
            for entry in range(member_starts[patch], member_starts[patch + 1]):
                i = members[entry]
                search_out[i, 0] = product_out[i, 0] + e0 + beta * search_out[i, 0]
                search_out[i, 1] = product_out[i, 1] + e1 + beta * search_out[i, 1]
                search_out[i, 2] = product_out[i, 2] + e2 + beta * search_out[i, 2]
        for chunk in prange(chunks):
            total = 0.0
            for i in range(chunk * CHUNK, min(count, (chunk + 1) * CHUNK)):
                p0, p1, p2, d = search_out[i, 0], search_out[i, 1], search_out[i, 2], diagonal[i]
                q0 = d[0] * p0 + d[1] * p1 + d[2] * p2
                q1 = d[1] * p0 + d[3] * p1 + d[4] * p2
                q2 = d[2] * p0 + d[4] * p1 + d[5] * p2
                for entry in range(ring_starts[i], ring_starts[i + 1]):
                    j, b = ring[entry], blocks[entry]
                    s0, s1, s2 = search_out[j, 0], search_out[j, 1], search_out[j, 2]
                    q0 += b[0] * s0 + b[1] * s1 + b[2] * s2
                    q1 += b[3] * s0 + b[4] * s1 + b[5] * s2
                    q2 += b[6] * s0 + b[7] * s1 + b[8] * s2
                for entry in range(far_starts[i], far_starts[i + 1]):
                    j, w = far[entry], far_bending[entry]
                    q0 += w * search_out[j, 0]
                    q1 += w * search_out[j, 1]
                    q2 += w * search_out[j, 2]
                product_out[i, 0], product_out[i, 1], product_out[i, 2] = q0, q1, q2
                total += p0 * q0 + p1 * q1 + p2 * q2
            partial_out[chunk] = total
        bend = 0.0
        for chunk in range(chunks):
            bend += partial_out[chunk]
        if not bend > 0.0:
            return iteration
        alpha = np.float32(old / bend)
    return iterations


__all__ = ["coarse_matrix", "conjugate_gradients", "factorise", "solve_band"]
