"""How a garment lay when it began to be moved by the network."""

import math
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from hemline.animators.simulated_proxy import QUALITY_LEVELS, SimulatedProxy
from hemline.arrays import Float

from .proxy_on_body import ProxyOnBody

FADE_SECONDS = 10.0
"""Time in which what is known of the beginning fades by a factor of e [s]."""


@dataclass(frozen=True, eq=False)
class Beginning:
    """Where a simulation had brought each vertex; cloth that slid down, or caught, stays so for a while."""

    offsets: Float[np.ndarray, "verts 3"]
    """From where skinning put it, in its turned frame [m]."""
    seconds: float = 0.0
    """How long ago [s]."""

    def later(self, dt: float) -> Self:
        """After a time [s]."""
        return replace(self, seconds=self.seconds + dt)

    def features(self) -> Float[np.ndarray, "verts begun"]:
        """What a vertex is told of it: how it lay, and how far that counts; all zero where nothing is known."""
        counts = math.exp(-self.seconds / FADE_SECONDS)
        return np.concatenate([counts * self.offsets, np.full((len(self.offsets), 1), counts)], axis=1, dtype=np.float32)


def opening_simulator(proxy: ProxyOnBody) -> SimulatedProxy:
    """What simulates a proxy at the beginning."""
    return SimulatedProxy(proxy.garment, proxy.shaped, QUALITY_LEVELS["good"].settings(), proxy.rest.astype(np.float64))
