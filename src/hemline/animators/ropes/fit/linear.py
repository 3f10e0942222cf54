"""Linear maps from bones: to vertices, the baseline, and to coefficients, where networks begin and often end."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from hemline.arrays import Float
from hemline.learning.fit.batches import SMALLEST_DEVIATION
from hemline.learning.mlp import Mlp
from hemline.learning.ridge import ridge, wide_ridge

from .basis_network import BasisNetwork
from .frames import KeyFrames
from .training_set import TrainingSet

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
        deviations = noise_on_bones(frames.free, noise)
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


def noise_on_bones(free: Float[np.ndarray, " ins"], noise: float) -> Float[np.ndarray, " ins"]:
    """Returns the standard deviation of the noise on each input [m].

    Args:
        free: 1 for coordinates of simulated bones, 0 for those that the body carries, which get the smallest one.
        noise: Noise on simulated bones [m].
    """
    return np.where(free > 0, noise, SMALLEST_DEVIATION)


def linear_network(training: TrainingSet, noise: float) -> Mlp:
    """Fits a network of one layer: the ridge regression from bones to coefficients.

    Args:
        training: Inputs, outputs and the split.
        noise: Standard deviation of the noise on simulated bones for which it is optimal [m].
    """
    inputs, outputs = training.bones[training.train], training.coefficients[training.train]
    matrix, offset = ridge(inputs, outputs, noise_on_bones(training.free, noise))
    return Mlp.from_weights([matrix], [offset])
