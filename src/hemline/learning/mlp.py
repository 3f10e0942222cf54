"""A small network at run time: float32, no torch."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from hemline.arrays import Float, Int
from hemline.errors import BadModel
from hemline.files.contents import AGAIN, array_of

from .mlp_kernels import LIFT, SMALLEST, layer

LAYERS = 3
"""Two hidden layers and the output."""


@dataclass(frozen=True)
class Mlp:
    r"""$y = W_3\,\mathrm{relu}(W_2\,\mathrm{relu}(W_1 x + b_1) + b_2) + b_3$.

    Weights hold values that float16 can hold, so that saving and loading changes no bit.
    """

    weights: tuple[Float[np.ndarray, "_outs _ins"], ...]
    biases: tuple[Float[np.ndarray, " _outs"], ...]

    @classmethod
    def rounded(cls, weights: list[np.ndarray], biases: list[np.ndarray]) -> Self:
        """Round trained weights to float16; biases stay float32.

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
    def _packed(self) -> tuple[tuple[Int[np.ndarray, "ins outs"], np.float32], ...]:
        return tuple(packed(weights) for weights in self.weights)

    def __call__(self, inputs: Float[np.ndarray, " ins"]) -> Float[np.ndarray, " outs"]:
        """The output for one input."""
        value = inputs
        for i, ((bits, scale), biases) in enumerate(zip(self._packed, self.biases, strict=True)):
            outputs = np.empty(len(biases), np.float32)
            layer(bits, scale, biases, value, i < LAYERS - 1, outputs)
            value = outputs
        return value

    def many(self, inputs: Float[np.ndarray, "rows ins"]) -> Float[np.ndarray, "rows outs"]:
        """The outputs for many inputs, in NumPy; equal to `__call__` up to rounding."""
        value = np.asarray(inputs, np.float32)
        for i, (weights, biases) in enumerate(zip(self.weights, self.biases, strict=True)):
            value = value @ weights.T + biases
            value = np.maximum(value, 0) if i < LAYERS - 1 else value
        return value

    def vanishing_at(self, inputs: Float[np.ndarray, " ins"]) -> "Mlp":
        """The same network less what it makes of one input: there its output is zero, up to rounding."""
        return replace(self, biases=(*self.biases[:-1], self.biases[-1] - self(inputs)))

    def silent(self) -> "Mlp":
        """A network of the same widths that answers zero to everything."""
        last, shift = np.zeros_like(self.weights[-1]), np.zeros_like(self.biases[-1])
        return replace(self, weights=(*self.weights[:-1], last), biases=(*self.biases[:-1], shift))

    def arrays(self) -> dict[str, np.ndarray]:
        """What a model file holds: `weight0..2` float16, `bias0..2` float32."""
        halves = {f"weight{i}": weights.astype(np.float16) for i, weights in enumerate(self.weights)}
        return halves | {f"bias{i}": biases for i, biases in enumerate(self.biases)}

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray], *, inputs: int, outputs: int) -> Self:
        """Read one back.

        Raises:
            BadModel: An array is missing or of another type or shape than the layers before and after ask for.
        """
        weights, biases, width = [], [], inputs
        for i in range(LAYERS):
            weight = array_of(arrays, f"weight{i}", "float16", (outputs if i == LAYERS - 1 else None, width))
            width = len(weight)
            weights.append(weight.astype(np.float32))
            biases.append(array_of(arrays, f"bias{i}", "float32", (width,)))
        if width == 0:
            raise BadModel("a network of the model has no outputs", 0, AGAIN)
        return cls(tuple(weights), tuple(biases))


def packed(weights: Float[np.ndarray, "outs ins"]) -> tuple[Int[np.ndarray, "ins outs"], np.float32]:
    """Weights as the kernel reads them, and the scale to read them with.

    All are first multiplied by a power of two, so that the kernel meets no float16 number below the normal ones. That
    changes no bit where all weights are below 64; else those below a 30,000,000th of the largest become zero.

    Args:
        weights: Values that float16 can hold, as float32.

    Returns:
        Bits of float16 numbers, int16, C-contiguous, and what a sum over inputs is to be multiplied by.
    """
    lift = min(10, 16 - int(np.frexp(np.abs(weights).max(initial=0.0))[1]))
    lifted = np.ldexp(weights.T, lift)
    lifted[np.abs(lifted) < SMALLEST] = 0.0
    return np.ascontiguousarray(lifted.astype(np.float16)).view(np.int16), np.float32(LIFT / 2.0**lift)
