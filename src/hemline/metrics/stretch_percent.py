"""How far edges of a garment are stretched beyond their length at rest: where it tears, this is large."""

from collections.abc import Sequence

import numpy as np

from hemline.arrays import Float, Int, Vertices
from hemline.meshes import strains

LONG = 0.3
"""An edge that is stretched by more is long [1]."""


def stretch_percent(
    vertices: Vertices, edges: Int[np.ndarray, "edges 2"], rest_lengths: Float[np.ndarray, " edges"]
) -> tuple[float, float]:
    r"""One-sided stretch $\max(0, \ell / \ell_0 - 1)$ of the edges of one frame.

    Edges that are shorter than at rest count as not stretched: cloth folds, and that is no fault.

    Args:
        vertices: The garment [m].
        edges: Edges to count, each once: those between two pins are not moved by the animator.
        rest_lengths: Their lengths at rest, on the pattern [m].

    Returns:
        The 99th percentile, and the share of edges that are more than 30 % too long [both in percent].
    """
    stretch = np.maximum(strains(np.asarray(vertices, np.float64), edges, rest_lengths), 0)
    return 100 * float(np.percentile(stretch, 99)), 100 * float((stretch > LONG).mean())


def stretch_figures(frames: Sequence[tuple[float, float]]) -> dict[str, float]:
    """The stretch of a clip.

    Args:
        frames: `stretch_percent` of each frame.

    Returns:
        `p99_mean` and `p99_worst` over the frames, and `long`, the mean share of long edges [all in percent].

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
