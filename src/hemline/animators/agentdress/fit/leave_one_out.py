"""Leave-one-out error of a per-region regression, in millimetres."""

import numpy as np

from hemline.arrays import Float

MOST_EVALUATED, MOST_VERTICES = 64, 1500
"""Most rows and most vertices that are evaluated; of more, an even selection is taken."""


def leave_one_out_mm(
    residuals: Float[np.ndarray, "regions rows outputs"],
    basis: Float[np.ndarray, "outputs entries"],
    regions: Float[np.ndarray, "verts regions"],
) -> float:
    """Returns the mean vertex error over the rows [mm].

    Args:
        residuals: Residual of each row in a fit without it, as coefficients of `basis`, per region [m].
        basis: Modes of the garment, one per row.
        regions: Weight of each region at each vertex.
    """
    step = -(-len(regions) // MOST_VERTICES)
    total, directions = 0.0, np.ascontiguousarray(basis.reshape(len(basis), -1, 3)[:, ::step])
    regions = regions[::step]
    rows = range(0, residuals.shape[1], -(-residuals.shape[1] // MOST_EVALUATED))
    for row in rows:
        mixed = regions @ residuals[:, row]
        total += float(np.linalg.norm(np.einsum("vk,kvi->vi", mixed, directions), axis=1).mean())
    return 1e3 * total / len(rows)
