"""Linear map from bones to vertices: the baseline of the networks."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from hemline.arrays import Float
from hemline.learning.fit.batches import SMALLEST_DEVIATION
from hemline.learning.ridge import ridge, wide_ridge

from .basis_network import BasisNetwork
from .frames import KeyFrames

SMALL_NOISE = 1e-4
"""Noise that only keeps a regression well-posed [m]."""


@dataclass(frozen=True)
class LinearMap:
    """The ridge regression from the simulated bones to all vertices, without a basis."""

    matrix: Float[np.ndarray, "rows ins"]
    offset: Float[np.ndarray, " rows"]
    """[m]"""
    noise: Float[np.ndarray, " ins"]
    """Standard deviation of the noise on the bones for which it is optimal [m]."""

    @classmethod
    def fit(cls, frames: KeyFrames, noise: float) -> Self:
        """Fits the map to the frames to train on."""
        deviations = noise_of(frames, noise)
        found = wide_ridge(frames.bones, lambda some: np.array(frames.displacements[some]), frames.train, deviations)
        return cls(*found, deviations)

    def rows(self, frames: KeyFrames, chosen: np.ndarray) -> Float[np.ndarray, "frames rows"]:
        """Returns displacements of the vertices in some frames [m]."""
        return frames.bones[chosen] @ self.matrix.T + self.offset

    def beyond(
        self, frames: KeyFrames, network: BasisNetwork
    ) -> tuple[Float[np.ndarray, "rows ins"], Float[np.ndarray, " rows"]]:
        """Returns the linear map to the residual of a network: this map less the map to the network's output.

        The latter is fitted without noise. With noise it would be damped twice, and the remainder would take room from
        what is new.
        """
        small = np.full(len(self.noise), SMALL_NOISE)
        made, offset = ridge(frames.bones[frames.train], network.coefficients[frames.train], small)
        basis = network.vectors.T
        return self.matrix - basis @ made.astype(np.float32), self.offset - basis @ offset.astype(np.float32)


def noise_of(frames: KeyFrames, noise: float) -> Float[np.ndarray, " ins"]:
    """Returns the standard deviation of noise on each bone; bones that the body carries get the smallest one [m]."""
    return np.where(frames.free > 0, noise, SMALLEST_DEVIATION)
