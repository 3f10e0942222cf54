"""Membrane and bending, gathered at the vertices; the isometric bending matrix.

Source: Bergou et al., "A quadratic bending model for inextensible surfaces", SGP 2006, section 3.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from hemline.compiled import kernel, prange

from .rows import Rows

VERTEX_CHUNK = 128
"""Vertices in one partial sum: fixed, so that sums do not depend on the number of threads."""

FAST = {"contract", "nsz", "arcp"}


class BendingMatrix(NamedTuple):
    """Off-diagonal entries q_ij of the bending matrix [N/m]; each diagonal entry is minus the sum of its row.

    The tuple is flat because tuples within tuples cost kernels microseconds to unpack.
    """

    ring_starts: Int[np.ndarray, " verts_and_one"]
    ring: Int[np.ndarray, " ring"]
    ring_bending: Float[np.ndarray, " ring"]
    far_starts: Int[np.ndarray, " verts_and_one"]
    far: Int[np.ndarray, " far"]
    far_bending: Float[np.ndarray, " far"]


@kernel(parallel=True, fastmath=FAST)
def elastic_at_vertices(x, incidence: Rows, corner, bending: BendingMatrix, bent, elastic_out, energy_out):
    """Sums the gradient of membrane and bending at each vertex, and the energy of the bending matrix by chunk.

    Model: E = -1/4 sum q_ij |x_i - x_j|^2 (bending)
    Reads: incidence: corners of each vertex, 3 face + corner; corner (faces, 9): gradient of the membrane there [N];
        bent (verts, 3): gradient of the hinges [N].
    Writes: elastic_out (verts, 3) [N]; energy_out (chunks,) [J].
    """
    corner_starts, corners = incidence
    ring_starts, ring, ring_bending, far_starts, far, far_bending = bending
    count = x.shape[0]
    for chunk in prange((count + VERTEX_CHUNK - 1) // VERTEX_CHUNK):
        energy = 0.0
        for i in range(chunk * VERTEX_CHUNK, min(count, (chunk + 1) * VERTEX_CHUNK)):
            x0, x1, x2 = x[i, 0], x[i, 1], x[i, 2]
            g0, g1, g2 = bent[i, 0], bent[i, 1], bent[i, 2]
            for entry in range(corner_starts[i], corner_starts[i + 1]):
                at = corners[entry]
                f, c = at // 3, 3 * (at % 3)
                g0 += corner[f, c]
                g1 += corner[f, c + 1]
                g2 += corner[f, c + 2]
            for entry in range(ring_starts[i], ring_starts[i + 1]):
                j, q = ring[entry], ring_bending[entry]
                e0, e1, e2 = x[j, 0] - x0, x[j, 1] - x1, x[j, 2] - x2
                g0 += q * e0
                g1 += q * e1
                g2 += q * e2
                energy -= 0.25 * q * (e0 * e0 + e1 * e1 + e2 * e2)
            for entry in range(far_starts[i], far_starts[i + 1]):
                j, q = far[entry], far_bending[entry]
                e0, e1, e2 = x[j, 0] - x0, x[j, 1] - x1, x[j, 2] - x2
                g0 += q * e0
                g1 += q * e1
                g2 += q * e2
                energy -= 0.25 * q * (e0 * e0 + e1 * e1 + e2 * e2)
            elastic_out[i, 0], elastic_out[i, 1], elastic_out[i, 2] = g0, g1, g2
        energy_out[chunk] = energy


__all__ = ["FAST", "VERTEX_CHUNK", "BendingMatrix", "elastic_at_vertices"]
