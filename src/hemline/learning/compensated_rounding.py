"""Rounds the weights of a kernel regression so that its predictions hardly change.

The weights of a smooth kernel are large and cancel in its sums, so that each rounding error shows many times enlarged.
Here weights are rounded one after the other, and those that are not rounded yet take up the error.
"""

from collections.abc import Callable

import numpy as np

from hemline.arrays import Float, Int

LARGEST_DIGIT = 127
"""Largest digit of 8 bits."""
ROOM = 1.05
"""Range of the digits over the largest weight, since weights grow while they take up errors."""
BLOCK_ROWS = 128
"""Number of samples that take up each other's errors one by one; the later ones take up the sum for a block."""


def round_to_digits(
    weights: Float[np.ndarray, "samples outputs"], inverse: Float[np.ndarray, "samples samples"]
) -> tuple[Int[np.ndarray, "samples outputs"], Float[np.ndarray, " outputs"]]:
    """Rounds weights to 8 bits; returns the digits, int8, and the step of each output, float32.

    Args:
        weights: Weights of the samples.
        inverse: Inverse of the kernel matrix with its ridge.
    """
    largest = np.abs(weights).max(axis=0)
    steps = (ROOM * np.where(largest > 0, largest, 1.0) / LARGEST_DIGIT).astype(np.float32).astype(np.float64)

    def quantise(row: np.ndarray) -> np.ndarray:
        return np.clip(np.rint(row / steps), -LARGEST_DIGIT, LARGEST_DIGIT) * steps

    rounded = _round_in_turn(weights, inverse, quantise)
    return np.rint(rounded / steps).astype(np.int8), steps.astype(np.float32)


def round_to_half(
    weights: Float[np.ndarray, "samples outputs"], inverse: Float[np.ndarray, "samples samples"]
) -> Float[np.ndarray, "samples outputs"]:
    """Rounds weights to half precision; returns them as float32.

    Args:
        weights: Weights of the samples.
        inverse: Inverse of the kernel matrix with its ridge.
    """
    rounded = _round_in_turn(weights, inverse, lambda row: row.astype(np.float16).astype(np.float64))
    return rounded.astype(np.float32)


def _round_in_turn(
    weights: np.ndarray, inverse: np.ndarray, quantise: Callable[[np.ndarray], np.ndarray]
) -> np.ndarray:
    r"""Returns rounded weights $\tilde w$ with a small $(\tilde w - w)^T H (\tilde w - w)$, H the kernel matrix.

    Source: Frantar et al., "GPTQ: Accurate Post-Training Quantization for Generative Pre-trained Transformers", 2023,
        Algorithm 1. Differs: H is the kernel matrix, so that the quadratic form is the squared norm of the change of
        the regression in the space of its kernel.
    """
    from scipy.linalg import cholesky

    factor = cholesky(np.asarray(inverse, np.float64))
    left, rounded, count = np.array(weights, np.float64), np.empty(weights.shape), len(weights)
    for begin in range(0, count, BLOCK_ROWS):
        end = min(begin + BLOCK_ROWS, count)
        errors = np.empty((end - begin, left.shape[1]))
        for i in range(begin, end):
            rounded[i] = quantise(left[i])
            errors[i - begin] = (left[i] - rounded[i]) / factor[i, i]
            left[i + 1 : end] -= np.outer(factor[i, i + 1 : end], errors[i - begin])
        left[end:] -= factor[begin:end, end:].T @ errors
    return rounded
