"""Inertia of a step, and the springs of soft pins, as one parabola per vertex."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from hemline.compiled import kernel


class Inertia(NamedTuple):
    """A parabola about a goal for each vertex.

    Attributes:
        goal: Minima of the parabolas [m].
        stiffness: m / h^2, plus the spring of a soft pin [N/m].
    """

    goal: Float[np.ndarray, "verts 3"]
    stiffness: Float[np.ndarray, " verts"]


@kernel(inline="always")
def inertia_terms(k, d0, d1, d2):
    """Computes the energy of a vertex at a distance d from its goal.

    Reads: k: inertial stiffness [N/m]; d0, d1, d2: x - goal [m].
    Returns: The energy [J], and the three coordinates of its gradient [N].
    """
    return 0.5 * k * (d0 * d0 + d1 * d1 + d2 * d2), k * d0, k * d1, k * d2


__all__ = ["Inertia", "inertia_terms"]
