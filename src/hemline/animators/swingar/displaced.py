"""Where vertices are, from where skinning puts them: what the network says, without jumps."""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np

from hemline.arrays import Float

FORGIVEN = 0.2
"""Time constant with which cloth goes from where a simulation left it to where the network puts it [s]."""
SMOOTHED = 0.05
"""Time constant with which it follows what the network says [s]."""


@dataclass(frozen=True, eq=False)
class Displaced:
    """Vectors in the turned frames of the vertices [m], float32."""

    now: Float[np.ndarray, "verts 3"]
    missed: Float[np.ndarray, "verts 3"] | None = None
    """What is not forgiven yet of what the network missed when the simulation ended; None: there was none."""

    @classmethod
    def handed_over(cls, lay: Float[np.ndarray, "verts 3"], said: Float[np.ndarray, "verts 3"]) -> Self:
        """Where a simulation has ended.

        Args:
            lay: Where it left each vertex.
            said: Where the network would have put it.
        """
        return cls(lay, lay - said)

    def followed(self, said: Float[np.ndarray, "verts 3"], dt: float) -> Self:
        """A time later [s], when the network says another thing."""
        missed = self.missed
        if missed is not None:
            missed = missed * np.float32(math.exp(-dt / FORGIVEN))
            said = said + missed
        return type(self)(said + np.float32(math.exp(-dt / SMOOTHED)) * (self.now - said), missed)
