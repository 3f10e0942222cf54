"""Ridge regression: the linear map with the least error on inputs with noise."""

from collections.abc import Callable

import numpy as np

from hemline.arrays import Float, Int

FRAMES_PER_BATCH = 256
"""Frames of many outputs that are processed at a time."""


def ridge(
    inputs: Float[np.ndarray, "frames ins"],
    outputs: Float[np.ndarray, "frames outs"],
    noise: Float[np.ndarray, " ins"],
    weights: Float[np.ndarray, " frames"] | None = None,
) -> tuple[Float[np.ndarray, "outs ins"], Float[np.ndarray, " outs"]]:
    r"""Returns the linear map with the least mean square error on inputs that carry noise.

    $$A = C_{yx} (C_{xx} + \mathrm{diag}(\sigma^2))^{-1}, \qquad a = \bar y - A \bar x$$

    Args:
        inputs: Inputs $x$.
        outputs: Outputs $y$.
        noise: Standard deviation $\sigma$ of the noise on each input.
        weights: Weight of each frame; None: all are equal.

    Returns:
        $A$ and $a$, float64.

    Source: Bishop, "Training with noise is equivalent to Tikhonov regularization", 1995.
    """
    x, y = inputs.astype(np.float64), outputs.astype(np.float64)
    fraction = np.full(len(x), 1 / len(x)) if weights is None else weights / weights.sum()
    x_mean, y_mean = fraction @ x, fraction @ y
    x, y = x - x_mean, y - y_mean
    weighted = x.T * fraction
    matrix = np.linalg.solve(weighted @ x + np.diag(noise.astype(np.float64) ** 2), weighted @ y).T
    return matrix, y_mean - matrix @ x_mean


def ridge_through_zero(
    inputs: Float[np.ndarray, "frames ins"],
    outputs: Float[np.ndarray, "frames outs"],
    noise: Float[np.ndarray, " ins"],
) -> Float[np.ndarray, "outs ins"]:
    """Returns the matrix of `ridge` without an offset: its output for zeros is zero.

    Args:
        inputs: Inputs.
        outputs: Outputs.
        noise: Standard deviation of the noise on each input.
    """
    x, y = inputs.astype(np.float64), outputs.astype(np.float64)
    return np.linalg.solve(x.T @ x / len(x) + np.diag(noise.astype(np.float64) ** 2), x.T @ y / len(x)).T


def wide_ridge(
    inputs: Float[np.ndarray, "frames ins"],
    outputs: Callable[[Int[np.ndarray, " some"]], Float[np.ndarray, "some outs"]],
    frames: Int[np.ndarray, " train"],
    noise: Float[np.ndarray, " ins"],
) -> tuple[Float[np.ndarray, "outs ins"], Float[np.ndarray, " outs"]]:
    """Returns the map of `ridge` for outputs that are too many to keep in memory at once.

    Args:
        inputs: Inputs of all frames.
        outputs: Returns the outputs of some frames, float32.
        frames: The frames to fit to.
        noise: Standard deviation of the noise on each input.

    Returns:
        $A$ and $a$, float32.
    """
    x_mean = inputs[frames].mean(axis=0, dtype=np.float64)
    x = (inputs[frames] - x_mean).astype(np.float32)
    products, y_mean = np.zeros(()), np.zeros(())
    for first in range(0, len(frames), FRAMES_PER_BATCH):
        some = slice(first, first + FRAMES_PER_BATCH)
        y = outputs(frames[some])
        products, y_mean = products + x[some].T @ y, y_mean + y.sum(axis=0, dtype=np.float64)
    square = x.T.astype(np.float64) @ x / len(x) + np.diag(noise.astype(np.float64) ** 2)
    matrix = np.linalg.solve(square, products / len(x)).T
    offset = y_mean / len(x) - matrix @ x_mean
    return np.ascontiguousarray(matrix, np.float32), offset.astype(np.float32)
