"""The collision term of the training: where a vertex that came to lie inside should rather be."""

from collections.abc import Callable

import numpy as np

from hemline.arrays import Float, Points

Distances = Callable[[int, Points], Float[np.ndarray, " points"]]
"""Signed distances to the body of one frame, negative inside, of points in that frame's key frame [m]."""


def pushed_out(
    points: Points,
    truth: Points,
    distances: Float[np.ndarray, " points"],
    truth_distances: Float[np.ndarray, " points"],
    expansion: float,
) -> Points:
    r"""Where each point should be: outside, in the direction of its true place.

    A point with $\phi < \epsilon$ goes to $x + \min(\epsilon - \phi, |r|)\,\hat r$ with $r = x^* - x$: one iteration.
    All others stay, and so do those whose true place is itself closer than $\epsilon$.

    Args:
        points: Positions that a network made [m].
        truth: True positions $x^*$ [m].
        distances: $\phi$ at the points [m].
        truth_distances: $\phi$ at the true positions [m].
        expansion: $\epsilon$, by which the body is expanded [m].

    Returns:
        The targets; the loss is the square of the distance to them.

    Source: Jin et al., "Rope chains", 2024, Sections 7 and 9 (push out along $\hat r$ towards the ground truth, target
        detached, expanded distance, one iteration). Differs: where the truth itself is inside the expanded body the
        term is masked, since there is no free place that it could lead to; the step ends at the truth at the latest.
    """
    towards = truth - points
    reach = np.linalg.norm(towards, axis=-1)
    acts = (distances < expansion) & (truth_distances >= expansion) & (reach > 1e-9)
    length = np.where(acts, np.minimum(expansion - distances, reach), 0.0)
    return points + (length / np.maximum(reach, 1e-9))[..., None] * towards
