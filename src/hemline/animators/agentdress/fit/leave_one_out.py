"""What a regression in regions misses at what is left out of it, in millimetres of the garment."""

import numpy as np

from hemline.arrays import Float

MOST_EVALUATED = 64
"""Rows that a regression is judged by; of more, as many are taken evenly."""


def leave_one_out_mm(
    left_out: Float[np.ndarray, "regions rows outputs"],
    basis: Float[np.ndarray, "outputs entries"],
    regions: Float[np.ndarray, "verts regions"],
) -> float:
    """Mean distance of vertices over the rows [mm].

    Args:
        left_out: What is missed of each row by a fit without it, as coefficients of `basis`, for each region [m].
        basis: Directions of the garment, one a row.
        regions: Share of each region in each vertex.
    """
    total, directions = 0.0, basis.reshape(len(basis), -1, 3)
    rows = range(0, left_out.shape[1], -(-left_out.shape[1] // MOST_EVALUATED))
    for row in rows:
        mixed = regions @ left_out[:, row]
        total += float(np.linalg.norm(np.einsum("vk,kvi->vi", mixed, directions), axis=1).mean())
    return 1e3 * total / len(rows)
