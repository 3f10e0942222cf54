"""Positions, normals and weights in one or two bytes per number, for `KHR_mesh_quantization`."""

from dataclasses import dataclass

import numpy as np

from hemline.arrays import Float, Int, Normals, Points

EXTENSION = "KHR_mesh_quantization"
_SHORT, _BYTE = 32767, 127


@dataclass(frozen=True)
class QuantizedGrid:
    """A cube around points, on which positions are whole numbers.

    Attributes:
        middle: Centre of the cube [m].
        half: Half of its side [m].
        most: Largest whole number, at the sides of the cube.
    """

    middle: Float[np.ndarray, " 3"]
    half: float
    most: int

    @classmethod
    def around(cls, points: Float[np.ndarray, "... 3"], most: int = _SHORT, *, least: float = 1e-9) -> "QuantizedGrid":
        """Returns the smallest grid around points whose half is at least `least` [m]."""
        low, high = (end(points.reshape(-1, 3), axis=0).astype(np.float64) for end in (np.min, np.max))
        return cls((low + high) / 2, max(float((high - low).max()) / 2, least), most)

    @property
    def scale(self) -> float:
        """Factor from normalised numbers to metres [m]."""
        return self.half * _SHORT / self.most

    def numbers(self, points: Points) -> Int[np.ndarray, "points 3"]:
        """Returns the nearest positions on the grid, int16; engines normalise them by 32767."""
        return np.rint((points - self.middle) / self.half * self.most).astype(np.int16)


def directions(vectors: Normals) -> Int[np.ndarray, "verts 3"]:
    """Returns vectors of numbers from -1 to 1 as normalised bytes."""
    return np.rint(np.clip(vectors, -1, 1) * _BYTE).astype(np.int8)


def normal_differences(normals: Normals, others: Normals) -> Normals:
    """Returns differences that turn normals into the directions of others, within -1 to 1 where possible.

    Engines normalise the sum, so the other vectors may be shortened as far as needed.
    """
    with np.errstate(divide="ignore"):
        most = (1 + np.sign(others) * normals) / np.abs(others)
    return np.clip(most.min(axis=1, keepdims=True), 1 / _BYTE, 1) * others - normals


def quantized_weights(weights: Float[np.ndarray, "verts 4"]) -> Int[np.ndarray, "verts 4"]:
    """Returns weights in two bytes; each row sums to 65535, which stands for 1."""
    numbers = np.rint(weights * 65535.0).astype(np.int64)
    numbers[:, 0] += np.rint(weights.sum(axis=1) * 65535.0).astype(np.int64) - numbers.sum(axis=1)
    return numbers.astype(np.uint16)
