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
            d = diagonal[i]
            xx += d[0]
            yx += d[1]
            yy += d[3]
            zx += d[2]
            zy += d[4]
            zz += d[5]
            for e in range(ring_starts[i], ring_starts[i + 1]):
                j, b = ring[e], blocks[e]
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
    ring_starts, ring, blocks, far_starts, far, far_bending, diagonal, inverse, member_starts, members, label,
    band, right, tolerance, iterations,
    solution_out, residual_out, search_out, product_out, partial_out, patch_sum_out, coarse_out,
):  # fmt: skip
    """Solve A x = right for the free vertices; the others, whose inverse is 0, stay 0.

    # model: A = blocks on the ring, far_bending I beyond it, symmetric diagonal; band = factor of the coarse matrix
    # in:  label: patch of each vertex, one past the last for fixed ones; tolerance: on sqrt(r . M r) relative to its
    #      start; iterations: at most
    # out: solution; the rest is working memory. Vectors are flat (3 verts), coarse has one patch more, which stays 0.
    # Returns the number of iterations.
    """
    count, patches = label.shape[0], member_starts.shape[0] - 1
    chunks = (count + CHUNK - 1) // CHUNK
    alpha, old, enough = np.float32(0.0), 0.0, 0.0
    for k in prange(3 * count):
        solution_out[k], residual_out[k], search_out[k], product_out[k] = 0.0, right[k], 0.0, 0.0
    for c in range(3):
        coarse_out[3 * patches + c] = 0.0
    for iteration in range(iterations + 1):
        for chunk in prange(chunks):
            first, end, total = chunk * CHUNK, min(count, (chunk + 1) * CHUNK), 0.0
            for k in range(3 * first, 3 * end):
                solution_out[k] += alpha * search_out[k]
                residual_out[k] -= alpha * product_out[k]
            for i in range(first, end):
                r0, r1, r2 = residual_out[3 * i], residual_out[3 * i + 1], residual_out[3 * i + 2]
                z0 = inverse[i, 0] * r0 + inverse[i, 1] * r1 + inverse[i, 2] * r2
                z1 = inverse[i, 1] * r0 + inverse[i, 3] * r1 + inverse[i, 4] * r2
                z2 = inverse[i, 2] * r0 + inverse[i, 4] * r1 + inverse[i, 5] * r2
                total += r0 * z0 + r1 * z1 + r2 * z2
            partial_out[chunk] = total
        for patch in prange(patches):
            sum0, sum1, sum2 = 0.0, 0.0, 0.0
            for entry in range(member_starts[patch], member_starts[patch + 1]):
                k = 3 * members[entry]
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
                k, c = 3 * i, 3 * label[i]
                r0, r1, r2 = residual_out[k], residual_out[k + 1], residual_out[k + 2]
                z0 = inverse[i, 0] * r0 + inverse[i, 1] * r1 + inverse[i, 2] * r2 + np.float32(coarse_out[c])
                z1 = inverse[i, 1] * r0 + inverse[i, 3] * r1 + inverse[i, 4] * r2 + np.float32(coarse_out[c + 1])
                z2 = inverse[i, 2] * r0 + inverse[i, 4] * r1 + inverse[i, 5] * r2 + np.float32(coarse_out[c + 2])
                search_out[k] = z0 + beta * search_out[k]
                search_out[k + 1] = z1 + beta * search_out[k + 1]
                search_out[k + 2] = z2 + beta * search_out[k + 2]
        for chunk in prange(chunks):
            total = 0.0
            for i in range(chunk * CHUNK, min(count, (chunk + 1) * CHUNK)):
                p0, p1, p2 = search_out[3 * i], search_out[3 * i + 1], search_out[3 * i + 2]
                # nine sums, so that no addition waits for the one before
                xx, xy, xz = diagonal[i, 0] * p0, diagonal[i, 1] * p1, diagonal[i, 2] * p2
                yx, yy, yz = diagonal[i, 1] * p0, diagonal[i, 3] * p1, diagonal[i, 4] * p2
                zx, zy, zz = diagonal[i, 2] * p0, diagonal[i, 4] * p1, diagonal[i, 5] * p2
                for entry in range(ring_starts[i], ring_starts[i + 1]):
                    j, k = 3 * ring[entry], 9 * entry
                    s0, s1, s2 = search_out[j], search_out[j + 1], search_out[j + 2]
                    xx += blocks[k] * s0
                    xy += blocks[k + 1] * s1
                    xz += blocks[k + 2] * s2
                    yx += blocks[k + 3] * s0
                    yy += blocks[k + 4] * s1
                    yz += blocks[k + 5] * s2
                    zx += blocks[k + 6] * s0
                    zy += blocks[k + 7] * s1
                    zz += blocks[k + 8] * s2
                for entry in range(far_starts[i], far_starts[i + 1]):
                    j, w = 3 * far[entry], far_bending[entry]
                    xx += w * search_out[j]
                    yy += w * search_out[j + 1]
                    zz += w * search_out[j + 2]
                q0, q1, q2 = xx + xy + xz, yx + yy + yz, zx + zy + zz
                product_out[3 * i], product_out[3 * i + 1], product_out[3 * i + 2] = q0, q1, q2
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
