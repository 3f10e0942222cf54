"""Rounds the weights of a kernel regression so that its predictions hardly change.

The weights of a smooth kernel are large and cancel in its sums, so that each rounding error shows many times enlarged.
Here weights are rounded one after the other, and those that are not rounded yet take up the error.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from hemline.arrays import Float, Int

LARGEST_DIGIT = 127
"""Largest digit of 8 bits."""
ROOM = 1.05
"""Range of the digits over the largest weight, since weights grow while they take up errors."""
SIZE_ROUNDS, LEAST_SIZE = 3, 1e-3
"""Rounds in which sizes of samples and of outputs are balanced, and least size of a sample over the largest."""
BLOCK_ROWS = 128
"""Number of samples that take up each other's errors one by one; the later ones take up the sum for a block."""


class PackedWeights(NamedTuple):
    """Weights of 8 bits: digit times size of the sample times step of the output."""

    digits: Int[np.ndarray, "samples outputs"]
    """Digits from -127 to 127, int8."""
    sizes: Float[np.ndarray, " samples"]
    """Size of the weights of each sample, float16."""
    steps: Float[np.ndarray, " outputs"]
    """Step of each output, float32."""

    @property
    def weights(self) -> Float[np.ndarray, "samples outputs"]:
        """The weights, float32."""
        return self.digits * grid(self.sizes, self.steps)


def grid(sizes: Float[np.ndarray, "... samples"], steps: Float[np.ndarray, "... outputs"]) -> np.ndarray:
    """Returns the weight that a digit of 1 stands for (..., samples, outputs), float32."""
    return sizes.astype(np.float32)[..., :, None] * steps[..., None, :]


def round_to_digits(
    weights: Float[np.ndarray, "samples outputs"], inverse: Float[np.ndarray, "samples samples"]
) -> PackedWeights:
    """Rounds weights to 8 bits.

    Args:
        weights: Weights of the samples.
        inverse: Inverse of the kernel matrix with its ridge.
    """
    sizes = _sizes(weights)
    largest = np.abs(weights / sizes.astype(np.float64)[:, None]).max(axis=0, initial=0)
    steps = (ROOM * np.where(largest > 0, largest, 1.0) / LARGEST_DIGIT).astype(np.float32)
    units = grid(sizes, steps).astype(np.float64)

    def quantise(row: np.ndarray, sample: int) -> np.ndarray:
        return np.clip(np.rint(row / units[sample]), -LARGEST_DIGIT, LARGEST_DIGIT) * units[sample]

    rounded = _round_in_turn(weights, inverse, quantise)
    return PackedWeights(np.rint(rounded / units).astype(np.int8), sizes, steps)


def _sizes(weights: np.ndarray) -> np.ndarray:
    """Returns sizes of the samples such that weights over sizes are as large in all samples, float16."""
    size = np.ones(len(weights))
    for _ in range(SIZE_ROUNDS):
        of_output = np.sqrt(((weights / size[:, None]) ** 2).mean(axis=0))
        size = np.sqrt(((weights / np.where(of_output > 0, of_output, 1.0)) ** 2).mean(axis=1))
        size = np.maximum(size, LEAST_SIZE * size.max(initial=0))
        size = np.where(size > 0, size, 1.0)
    return (size / size.max(initial=0)).astype(np.float16) if len(size) else size.astype(np.float16)


def round_to_half(
    weights: Float[np.ndarray, "samples outputs"], inverse: Float[np.ndarray, "samples samples"]
) -> Float[np.ndarray, "samples outputs"]:
    """Rounds weights to half precision; returns them as float32.

    Args:
        weights: Weights of the samples.
        inverse: Inverse of the kernel matrix with its ridge.
    """
    rounded = _round_in_turn(weights, inverse, lambda row, sample: row.astype(np.float16).astype(np.float64))
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
            rounded[i] = quantise(left[i], i)
            errors[i - begin] = (left[i] - rounded[i]) / factor[i, i]
            left[i + 1 : end] -= np.outer(factor[i, i + 1 : end], errors[i - begin])
        left[end:] -= factor[begin:end, end:].T @ errors
    return rounded
