"""How a garment lay on the body when the network took over from the simulation."""

import math
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from hemline.animators.newton_solver import newton_settings
from hemline.animators.simulated_proxy import SimulatedProxy
from hemline.arrays import Float

from .proxy_on_body import ProxyOnBody

FADE_SECONDS = 10.0
"""Time constant with which this knowledge fades [s]."""


@dataclass(frozen=True, eq=False)
class Beginning:
    """Where a simulation left each vertex. Cloth that had slid down or caught stays so for a while."""

    offsets: Float[np.ndarray, "verts 3"]
    """Offset of each vertex from skinning, in its rotated frame [m]."""
    seconds: float = 0.0
    """Time since then [s]."""

    def later(self, dt: float) -> Self:
        """Returns the same beginning after a time [s]."""
        return replace(self, seconds=self.seconds + dt)

    def features(self) -> Float[np.ndarray, "verts beginning"]:
        """Returns the features of each vertex: its faded offset and the factor of the fading. Zeros mean "unknown"."""
        factor = math.exp(-self.seconds / FADE_SECONDS)
        return np.concatenate(
            [factor * self.offsets, np.full((len(self.offsets), 1), factor)], axis=1, dtype=np.float32
        )


def opening_simulator(proxy: ProxyOnBody) -> SimulatedProxy:
    """Returns what simulates a proxy before the network takes over."""
    return SimulatedProxy(proxy.garment, proxy.shaped, newton_settings(), proxy.rest.astype(np.float64))
