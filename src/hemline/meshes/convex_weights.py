"""Convex weights, which are not negative and sum to 1, fitted by least squares."""

import numpy as np

from hemline.arrays import Float

_ROUNDS = 400
"""Steps of the projected gradient."""


def fit_convex_weights(
    square: Float[np.ndarray, "points some some"],
    along: Float[np.ndarray, "points some"],
    start: Float[np.ndarray, "points some"],
    *,
    rounds: int = _ROUNDS,
) -> Float[np.ndarray, "points some"]:
    """Finds convex weights w that minimise w S w / 2 - a w, point by point, by an accelerated projected gradient.

    Args:
        square: S, the products of the candidates with each other, in the unit of `along`.
        along: a, the products of the candidates with the target.
        start: Weights to start from [1].
        rounds: Number of steps.

    Source: Beck, Teboulle, "A Fast Iterative Shrinkage-Thresholding Algorithm for Linear Inverse Problems", 2009.
    """
    step = 1 / np.maximum(np.trace(square, axis1=1, axis2=2), 1e-12)[:, None]
    current, ahead, momentum = start, start, 1.0
    for _ in range(rounds):
        slope = np.einsum("vkl,vl->vk", square, ahead) - along
        new = project_to_simplex(ahead - step * slope)
        next_momentum = 0.5 * (1 + np.sqrt(1 + 4 * momentum * momentum))
        ahead, current, momentum = new + (momentum - 1) / next_momentum * (new - current), new, next_momentum
    return current


def project_to_simplex(values: Float[np.ndarray, "points some"]) -> Float[np.ndarray, "points some"]:
    """Projects each row onto the simplex: returns the nearest convex weights [1].

    Source: Duchi, Shalev-Shwartz, Singer, Chandra, "Efficient Projections onto the l1-Ball for Learning in High
        Dimensions", 2008, figure 1.
    """
    ranked = -np.sort(-values, axis=1)
    excess = np.cumsum(ranked, axis=1) - 1
    count = np.arange(1, values.shape[1] + 1)
    kept = (ranked - excess / count > 0).sum(axis=1)
    shift = np.take_along_axis(excess, kept[:, None] - 1, axis=1) / kept[:, None]
    return np.maximum(values - shift, 0)
