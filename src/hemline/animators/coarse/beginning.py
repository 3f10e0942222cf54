"""How a garment lay when it began to be moved by the network."""

import math
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from hemline.animators.simulated_proxy import LEVELS, SimulatedProxy
from hemline.arrays import Float

from .proxy_on_body import ProxyOnBody

FADES = 10.0
"""Time in which what is known of the beginning fades by a factor of e [s]."""


@dataclass(frozen=True, eq=False)
class Beginning:
    """Where a simulation had brought each vertex; cloth that slid down, or caught, stays so for a while."""

    lay: Float[np.ndarray, "verts 3"]
    """From where skinning put it, in its turned frame [m]."""
    seconds: float = 0.0
    """How long ago [s]."""

    def later(self, dt: float) -> Self:
        """After a time [s]."""
        return replace(self, seconds=self.seconds + dt)

    def told(self) -> Float[np.ndarray, "verts begun"]:
        """What a vertex is told of it: how it lay, and how far that counts; all zero where nothing is known."""
        counts = math.exp(-self.seconds / FADES)
        return np.concatenate([counts * self.lay, np.full((len(self.lay), 1), counts)], axis=1, dtype=np.float32)


def beginner(proxy: ProxyOnBody) -> SimulatedProxy:
    """What simulates a proxy at the beginning."""
    return SimulatedProxy(proxy.garment, proxy.shaped, LEVELS["good"].settings(), proxy.rest.astype(np.float64))
