"""A small network at run time: float32, no torch."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from hemline.arrays import Float, Int
from hemline.errors import BadModel
from hemline.files.contents import AGAIN, array_of

from .mlp_kernels import HALF_SCALE, SMALLEST_HALF, layer

LAYERS = 3
"""Number of layers of a network: two hidden layers and the output. A linear map has one."""


@dataclass(frozen=True)
class Mlp:
    r"""$y = W_3\,\mathrm{relu}(W_2\,\mathrm{relu}(W_1 x + b_1) + b_2) + b_3$, or with one layer $y = W_1 x + b_1$.

    Weights hold values that float16 can hold, so that saving and loading changes no bit.
    """

    weights: tuple[Float[np.ndarray, "_outs _ins"], ...]
    biases: tuple[Float[np.ndarray, " _outs"], ...]

    @classmethod
    def from_weights(cls, weights: list[np.ndarray], biases: list[np.ndarray]) -> Self:
        """Makes a network from trained weights, rounded to float16; biases stay float32.

        Raises:
            BadModel: A weight is too large for float16, or not finite: the training diverged.
        """
        halves = [np.clip(w, -7e4, 7e4).astype(np.float32) for w in weights]
        if not all(np.isfinite(w).all() and np.abs(w).max(initial=0) < 6.5e4 for w in weights):
            raise BadModel("the training diverged", "weights beyond float16", "lower the learning rate")
        return cls(
            tuple(np.ascontiguousarray(w.astype(np.float16).astype(np.float32)) for w in halves),
            tuple(np.ascontiguousarray(b, np.float32) for b in biases),
        )

    @cached_property
    def _half_weights(self) -> tuple[tuple[Int[np.ndarray, "ins outs"], np.float32], ...]:
        return tuple(pack_weights(weights) for weights in self.weights)

    def __call__(self, inputs: Float[np.ndarray, " ins"]) -> Float[np.ndarray, " outs"]:
        """Returns the output for one input."""
        value = inputs
        for i, ((bits, scale), biases) in enumerate(zip(self._half_weights, self.biases, strict=True)):
            outputs = np.empty(len(biases), np.float32)
            layer(bits, scale, biases, value, i < len(self.weights) - 1, outputs)
            value = outputs
        return value

    def many(self, inputs: Float[np.ndarray, "rows ins"]) -> Float[np.ndarray, "rows outs"]:
        """Returns the outputs for many inputs, computed in NumPy; equal to `__call__` up to rounding."""
        value = np.asarray(inputs, np.float32)
        for i, (weights, biases) in enumerate(zip(self.weights, self.biases, strict=True)):
            value = value @ weights.T + biases
            value = np.maximum(value, 0) if i < len(self.weights) - 1 else value
        return value

    def with_zero_at(self, inputs: Float[np.ndarray, " ins"]) -> "Mlp":
        """Returns this network less its output for one input, for which the new output is zero up to rounding."""
        return replace(self, biases=(*self.biases[:-1], self.biases[-1] - self(inputs)))

    def with_zero_output(self) -> "Mlp":
        """Returns a network of the same widths whose output is always zero."""
        last, shift = np.zeros_like(self.weights[-1]), np.zeros_like(self.biases[-1])
        return replace(self, weights=(*self.weights[:-1], last), biases=(*self.biases[:-1], shift))

    def arrays(self) -> dict[str, np.ndarray]:
        """Returns the arrays of a model file: `weight0..2` float16, `bias0..2` float32, or those of the only layer."""
        halves = {f"weight{i}": weights.astype(np.float16) for i, weights in enumerate(self.weights)}
        return halves | {f"bias{i}": biases for i, biases in enumerate(self.biases)}

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray], *, inputs: int, outputs: int) -> Self:
        """Makes a network from the arrays of a model file.

        Args:
            arrays: As `arrays` returns them.
            inputs: Number of inputs.
            outputs: Number of outputs.

        Raises:
            BadModel: An array is missing, or its type or shape does not fit the layers beside it.
        """
        weights, biases, width = [], [], inputs
        layers = LAYERS if any(f"{name}{i}" in arrays for name in ("weight", "bias") for i in range(1, LAYERS)) else 1
        for i in range(layers):
            weight = array_of(arrays, f"weight{i}", "float16", (outputs if i == layers - 1 else None, width))
            width = len(weight)
            weights.append(weight.astype(np.float32))
            biases.append(array_of(arrays, f"bias{i}", "float32", (width,)))
        if width == 0:
            raise BadModel("a network of the model has no outputs", 0, AGAIN)
        return cls(tuple(weights), tuple(biases))


def pack_weights(weights: Float[np.ndarray, "outs ins"]) -> tuple[Int[np.ndarray, "ins outs"], np.float32]:
    """Packs weights for the kernel.

    All are first multiplied by a power of two, so that the kernel meets no float16 number below the normal ones. That
    changes no bit where all weights are below 64; otherwise weights below a 30,000,000th of the largest become zero.

    Args:
        weights: Values that float16 can hold, as float32.

    Returns:
        Bits of float16 numbers, int16, C-contiguous, and the factor to multiply sums over inputs by.
    """
    lift = min(10, 16 - int(np.frexp(np.abs(weights).max(initial=0.0))[1]))
    lifted = np.ldexp(weights.T, lift)
    lifted[np.abs(lifted) < SMALLEST_HALF] = 0.0
    return np.ascontiguousarray(lifted.astype(np.float16)).view(np.int16), np.float32(HALF_SCALE / 2.0**lift)
