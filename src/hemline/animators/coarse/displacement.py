"""Where vertices are, from where skinning puts them: what the network says, without jumps."""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np

from hemline.arrays import Float

TRANSIENT_SECONDS = 0.2
"""Time constant with which most cloth goes from where a simulation left it to where the network puts it [s]."""
PERSISTENT_SECONDS = 8.0
"""Time constant of what it missed because cloth had slid or caught [s]."""
PERSISTENT_FRACTION = 0.5
"""How much of what the network missed that is."""
SMOOTHING_SECONDS = 0.05
"""Time constant with which it follows what the network says [s]."""


@dataclass(frozen=True, eq=False)
class Displacement:
    """Vectors in the turned frames of the vertices [m], float32."""

    current: Float[np.ndarray, "verts 3"]
    transient: Float[np.ndarray, "verts 3"] | None = None
    """What is not forgiven yet of what the network missed when the simulation ended; None: there was none."""
    persistent: Float[np.ndarray, "verts 3"] | None = None
    """The part of it that lasts."""

    @classmethod
    def after_simulation(cls, lay: Float[np.ndarray, "verts 3"], said: Float[np.ndarray, "verts 3"]) -> Self:
        """Where a simulation has ended.

        What a network misses has two parts: how cloth swings, which is another thing a moment later, and where it has
        come to lie on the body, which is the same seconds later.

        Args:
            lay: Where it left each vertex.
            said: Where the network would have put it.
        """
        missed = np.float32(1 - PERSISTENT_FRACTION) * (lay - said)
        return cls(lay, missed, (lay - said) - missed)

    def advance(self, said: Float[np.ndarray, "verts 3"], dt: float) -> Self:
        """A time later [s], when the network says another thing."""
        missed, slid = self.transient, self.persistent
        if missed is not None and slid is not None:
            missed = missed * np.float32(math.exp(-dt / TRANSIENT_SECONDS))
            slid = slid * np.float32(math.exp(-dt / PERSISTENT_SECONDS))
            said = said + missed + slid
        return type(self)(said + np.float32(math.exp(-dt / SMOOTHING_SECONDS)) * (self.current - said), missed, slid)
