"""Positions, normals and weights in one and two bytes a number, as `KHR_mesh_quantization` allows."""

from dataclasses import dataclass

import numpy as np

from hemline.arrays import Float, Int, Normals, Points

EXTENSION = "KHR_mesh_quantization"
_SHORT, _BYTE = 32767, 127


@dataclass(frozen=True)
class QuantizedGrid:
    """A cube of whole numbers around points; what is stored is a share of its half.

    Attributes:
        middle: Its middle [m].
        half: Half of its side [m].
        most: The largest whole number.
    """

    middle: Float[np.ndarray, " 3"]
    half: float
    most: int

    @classmethod
    def around(cls, points: Float[np.ndarray, "... 3"], most: int = _SHORT, *, least: float = 1e-9) -> "Grid":
        """The smallest grid that holds all points, its half no smaller than `least` [m]."""
        low, high = (end(points.reshape(-1, 3), axis=0).astype(np.float64) for end in (np.min, np.max))
        return cls((low + high) / 2, max(float((high - low).max()) / 2, least), most)

    @property
    def scale(self) -> float:
        """What a share is multiplied with [m]."""
        return self.half * _SHORT / self.most

    def numbers(self, points: Points) -> Int[np.ndarray, "points 3"]:
        """The nearest places on the grid, int16; shares are these numbers by 32767."""
        return np.rint((points - self.middle) / self.half * self.most).astype(np.int16)


def directions(vectors: Normals) -> Int[np.ndarray, "verts 3"]:
    """Vectors of numbers from -1 to 1 as shares of a byte."""
    return np.rint(np.clip(vectors, -1, 1) * _BYTE).astype(np.int8)


def normal_differences(normals: Normals, others: Normals) -> Normals:
    """What is added to normals so that they point along others, no number of it beyond -1 to 1 where that is possible.

    A sum is scaled to unit length before it is used, so that others may be shortened: by s, the most that fits.
    """
    with np.errstate(divide="ignore"):
        most = (1 + np.sign(others) * normals) / np.abs(others)
    return np.clip(most.min(axis=1, keepdims=True), 1 / _BYTE, 1) * others - normals


def quantized_weights(weights: Float[np.ndarray, "verts 4"]) -> Int[np.ndarray, "verts 4"]:
    """Weights in two bytes; rows keep the sum of 65535, which is 1."""
    numbers = np.rint(weights * 65535.0).astype(np.int64)
    numbers[:, 0] += np.rint(weights.sum(axis=1) * 65535.0).astype(np.int64) - numbers.sum(axis=1)
    return numbers.astype(np.uint16)
