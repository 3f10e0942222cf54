"""How much is left for the projection to do."""

import numpy as np

from hemline.arrays import Vertices

RESOLVED_MM = 1.0
"""A vertex that the projection moves by more was not where it could stay."""


def resolved_percent(before: Vertices, after: Vertices) -> float:
    """Vertices of one frame that the projection moved by more than a millimetre.

    Args:
        before: The garment before the projection [m].
        after: The same after it [m].

    Returns:
        The share [percent of the vertices].
    """
    moved = np.linalg.norm(np.asarray(after, np.float64) - before, axis=1)
    return 100 * float((1e3 * moved > RESOLVED_MM).mean())
