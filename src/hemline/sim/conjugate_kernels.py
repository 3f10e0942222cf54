"""Preconditioned conjugate gradients on 3 x 3 blocks: float32 storage, float64 sums in a fixed order."""

import numpy as np

from hemline.compiled import kernel, prange

CHUNK = 128
FAST = {"contract", "nsz", "arcp"}


@kernel(parallel=True, fastmath=FAST)
def conjugate_gradients(
    ring_starts, ring, blocks, far_starts, far, far_bending, diagonal, inverse, right, tolerance, iterations,
    solution_out, residual_out, search_out, product_out, partial_out,
):  # fmt: skip
    """Solve A x = right for the free vertices; the others stay 0.

    # model: A = blocks on the ring, far_bending I beyond it, symmetric diagonal; preconditioner = inverse
    # in:  tolerance: on sqrt(r . M r) relative to its start; iterations: at most
    # out: solution; the rest is working memory; partial (chunks, 2). Returns the number of iterations.
    """
    count = right.shape[0]
    chunks = (count + CHUNK - 1) // CHUNK
    for chunk in prange(chunks):
        total = 0.0
        for i in range(chunk * CHUNK, min(count, (chunk + 1) * CHUNK)):
            r0, r1, r2, m = right[i, 0], right[i, 1], right[i, 2], inverse[i]
            z0 = m[0] * r0 + m[1] * r1 + m[2] * r2
            z1 = m[1] * r0 + m[3] * r1 + m[4] * r2
            z2 = m[2] * r0 + m[4] * r1 + m[5] * r2
            for c in range(3):
                solution_out[i, c] = 0.0
                residual_out[i, c] = right[i, c]
            search_out[i, 0], search_out[i, 1], search_out[i, 2] = z0, z1, z2
            total += r0 * z0 + r1 * z1 + r2 * z2
        partial_out[chunk, 0] = total
    old = 0.0
    for chunk in range(chunks):
        old += partial_out[chunk, 0]
    enough = tolerance * tolerance * old
    if not old > 0.0:
        return 0
    for iteration in range(iterations):
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
            partial_out[chunk, 1] = total
        bend = 0.0
        for chunk in range(chunks):
            bend += partial_out[chunk, 1]
        if not bend > 0.0:
            return iteration
        alpha = np.float32(old / bend)
        for chunk in prange(chunks):
            total = 0.0
            for i in range(chunk * CHUNK, min(count, (chunk + 1) * CHUNK)):
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
            partial_out[chunk, 0] = total
        new = 0.0
        for chunk in range(chunks):
            new += partial_out[chunk, 0]
        if not new > enough:
            return iteration + 1
        beta = np.float32(new / old)
        old = new
        for chunk in prange(chunks):
            for i in range(chunk * CHUNK, min(count, (chunk + 1) * CHUNK)):
                for c in range(3):
                    search_out[i, c] = product_out[i, c] + beta * search_out[i, c]
    return iterations


__all__ = ["conjugate_gradients"]
