"""Stretch of a garment's edges beyond their length at rest; it is large where the garment tears."""

from collections.abc import Sequence

import numpy as np

from hemline.arrays import Float, Int, Vertices
from hemline.meshes import strains

LONG_STRETCH = 0.3
"""Stretch above which an edge counts as long [1]."""


def stretch_percent(
    vertices: Vertices, edges: Int[np.ndarray, "edges 2"], rest_lengths: Float[np.ndarray, " edges"]
) -> tuple[float, float]:
    r"""Summarises the one-sided stretch $\max(0, \ell / \ell_0 - 1)$ of the edges of one frame.

    Edges shorter than at rest count as not stretched, since cloth may fold.

    Args:
        vertices: The garment [m].
        edges: Edges to count, each once, without those between two pins, which the animator does not move.
        rest_lengths: Lengths of the edges at rest, on the pattern [m].

    Returns:
        The 99th percentile, and the fraction of edges that are more than 30 % too long [both in percent].
    """
    stretch = np.maximum(strains(np.asarray(vertices, np.float64), edges, rest_lengths), 0)
    return 100 * float(np.percentile(stretch, 99)), 100 * float((stretch > LONG_STRETCH).mean())


def stretch_figures(frames: Sequence[tuple[float, float]]) -> dict[str, float]:
    """Summarises the stretch of a clip.

    Args:
        frames: `stretch_percent` of each frame.

    Returns:
        `p99_mean` and `p99_worst` over the frames, and `long`, the mean fraction of long edges [all in percent].

    Example:
        >>> stretch_figures([(10.0, 0.0), (20.0, 1.0)])
        {'p99_mean': 15.0, 'p99_worst': 20.0, 'long': 0.5}
    """
    every = np.asarray(frames, np.float64)
    return {
        "p99_mean": float(every[:, 0].mean()),
        "p99_worst": float(every[:, 0].max()),
        "long": float(every[:, 1].mean()),
    }
