"""Inertia of a step, and the springs of soft pins: one parabola a vertex."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from hemline.compiled import kernel


class Inertia(NamedTuple):
    """Parabolas about a goal.

    Attributes:
        goal: Their minima [m].
        stiffness: m / h^2, and the spring of a soft pin besides [N/m].
    """

    goal: Float[np.ndarray, "verts 3"]
    stiffness: Float[np.ndarray, " verts"]


@kernel(inline="always")
def inertia_terms(k, d0, d1, d2):
    """Energy of a vertex that is d from its goal, and its gradient."""
    return 0.5 * k * (d0 * d0 + d1 * d1 + d2 * d2), k * d0, k * d1, k * d2


__all__ = ["Inertia", "inertia_terms"]
