"""A straight line from bones to vertices: what networks must beat."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from hemline.arrays import Float
from hemline.learning.fit.batches import SMALLEST_DEVIATION
from hemline.learning.ridge import ridge, wide_ridge

from .frames import Frames
from .stage import Stage

HARDLY = 1e-4
"""Noise that only keeps a regression sound [m]."""


@dataclass(frozen=True)
class LinearMap:
    """The ridge regression from the simulated bones to all vertices, in no basis."""

    matrix: Float[np.ndarray, "rows ins"]
    offset: Float[np.ndarray, " rows"]
    """[m]"""
    noise: Float[np.ndarray, " ins"]
    """Standard deviation of the noise on the bones that it is best for [m]."""

    @classmethod
    def fitted(cls, frames: Frames, noise: float) -> Self:
        """The one that is best on the frames to train on."""
        deviations = noise_of(frames, noise)
        found = wide_ridge(frames.bones, lambda some: np.array(frames.displacements[some]), frames.train, deviations)
        return cls(*found, deviations)

    def rows(self, frames: Frames, chosen: np.ndarray) -> Float[np.ndarray, "frames rows"]:
        """Displacements that it makes of some frames [m]."""
        return frames.bones[chosen] @ self.matrix.T + self.offset

    def beyond(self, frames: Frames, stage: Stage) -> tuple[Float[np.ndarray, "rows ins"], Float[np.ndarray, " rows"]]:
        """The linear map to what a stage leaves over: this one less that to what the stage makes, without noise.

        With noise the line would be held back twice, and what is left of it would take room from what is new.
        """
        hardly = np.full(len(self.noise), HARDLY)
        made, offset = ridge(frames.bones[frames.train], stage.coefficients[frames.train], hardly)
        basis = stage.unpacked.T
        return self.matrix - basis @ made.astype(np.float32), self.offset - basis @ offset.astype(np.float32)


def noise_of(frames: Frames, noise: float) -> Float[np.ndarray, " ins"]:
    """Standard deviation of noise on each bone; those that the body carries get what keeps the regression sound [m]."""
    return np.where(frames.free > 0, noise, SMALLEST_DEVIATION)
