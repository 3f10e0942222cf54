r"""The memory of a moving point: filters of its path, exact for any time step.

Each filter follows a point $p$ that moves along a straight line within a step, and starts at rest on it. It stores how
far it trails behind, $h = y - p$:

$$\text{lag of } \tau: \quad y' = (p - y) / \tau \qquad\qquad
  \text{swing of } \omega, \zeta: \quad y'' = \omega^2 (p - y) + 2 \zeta \omega (p' - y')$$

A lag is an exponential average of the past; a swing is a damped pendulum hung from the point, whose period is
$2 \pi / \omega$.
"""

import math
from dataclasses import dataclass

import numpy as np

from hemline.arrays import Float

LAGS = (0.05, 0.15, 0.5)
"""Time constants [s]."""
SWINGS = ((4.0, 0.3), (7.0, 0.3), (12.0, 0.4))
"""Angular frequencies [rad/s] and damping ratios."""
FILTER_COUNT = len(LAGS) + 2 * len(SWINGS)
"""Number of vectors that the filters of a point store: the trail of each, and the velocity of each swing."""
SWING_SECONDS = np.array([1 / omega for omega, _ in SWINGS], np.float32)
"""Times that turn the velocity of each swing into a length [s]."""


@dataclass(frozen=True)
class FilterStep:
    """Coefficients of the filters for one time step, float32."""

    lags: Float[np.ndarray, "lags 2"]
    """h' = a h - b v."""
    swings: Float[np.ndarray, "swings 4"]
    """(h, g)' = [[a, b], [c, d]] (h, g), with g = h' of the filter before the point's new velocity is taken off."""

    @classmethod
    def of(cls, dt: float) -> "FilterStep":
        """Computes the coefficients for a time step [s]."""
        lags = [(math.exp(-dt / tau), tau * -math.expm1(-dt / tau)) for tau in LAGS]
        return cls(np.array(lags, np.float32), np.array([_swing(dt, *each) for each in SWINGS], np.float32))


def _swing(dt: float, omega: float, zeta: float) -> tuple[float, float, float, float]:
    """Returns the matrix exponential of h'' = -omega^2 h - 2 zeta omega h' over `dt`."""
    decay, fast = zeta * omega, omega * math.sqrt(1 - zeta * zeta)
    shrunk, c, s = math.exp(-decay * dt), math.cos(fast * dt), math.sin(fast * dt) / fast
    return (shrunk * (c + decay * s), shrunk * s, -shrunk * omega * omega * s, shrunk * (c - decay * s))
