"""Percentage of vertices that the projection has to move."""

import numpy as np

from hemline.arrays import Vertices

RESOLVED_MM = 1.0
"""Displacement above which a vertex counts as moved [mm]."""


def resolved_percent(before: Vertices, after: Vertices) -> float:
    """Returns the percentage of vertices of one frame that the projection moved by more than a millimetre.

    Args:
        before: The garment before the projection [m].
        after: The garment after it [m].

    Returns:
        The percentage of the vertices.
    """
    moved = np.linalg.norm(np.asarray(after, np.float64) - before, axis=1)
    return 100 * float((1e3 * moved > RESOLVED_MM).mean())
