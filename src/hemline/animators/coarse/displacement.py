"""Displacements of vertices from skinning: those that a network predicts, smoothed and without jumps."""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np

from hemline.arrays import Float

TRANSIENT_SECONDS = 0.2
"""Time constant of the transient part of what the network misses when the simulation ends [s]."""
PERSISTENT_SECONDS = 8.0
"""Time constant of the persistent part, cloth that had slid or caught [s]."""
PERSISTENT_FRACTION = 0.5
"""Fraction of what the network misses that persists."""
SMOOTHING_SECONDS = 0.05
"""Time constant with which displacements follow the network [s]."""


@dataclass(frozen=True, eq=False)
class Displacement:
    """Displacements in the rotated frames of the vertices (verts, 3) [m], float32."""

    current: Float[np.ndarray, "verts 3"]
    """Displacements that are shown."""
    transient: Float[np.ndarray, "verts 3"] | None = None
    """Remaining transient part of what the network missed when the simulation ended; None without a simulation."""
    persistent: Float[np.ndarray, "verts 3"] | None = None
    """Remaining persistent part."""

    @classmethod
    def after_simulation(cls, simulated: Float[np.ndarray, "verts 3"], predicted: Float[np.ndarray, "verts 3"]) -> Self:
        """Returns the displacements at the end of a simulation.

        What a network misses has two parts. How the cloth swings is different a moment later; where it came to lie on
        the body is the same seconds later.

        Args:
            simulated: Displacements of the simulated vertices.
            predicted: Displacements that the network predicts for the same frame.
        """
        transient = np.float32(1 - PERSISTENT_FRACTION) * (simulated - predicted)
        return cls(simulated, transient, (simulated - predicted) - transient)

    def advance(self, predicted: Float[np.ndarray, "verts 3"], dt: float) -> Self:
        """Returns the displacements after a time [s], when the network predicts others."""
        transient, persistent = self.transient, self.persistent
        if transient is not None and persistent is not None:
            transient = transient * np.float32(math.exp(-dt / TRANSIENT_SECONDS))
            persistent = persistent * np.float32(math.exp(-dt / PERSISTENT_SECONDS))
            predicted = predicted + transient + persistent
        kept = np.float32(math.exp(-dt / SMOOTHING_SECONDS))
        return type(self)(predicted + kept * (self.current - predicted), transient, persistent)
