"""Slow closing of seams that are open at the start, so that the cloth is not pulled through anything."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from hemline.sim.cloth.sheet import Positions, Sheet
from hemline.sim.step.state import ClothState

CLOSED_STRETCH = 1.5
"""Largest stretch of an edge, as a factor, below which the garment counts as sewn."""

MAX_SEWING_STEPS = 400
"""Maximum number of steps."""


def sew(sheet: Sheet, state: ClothState, step: Callable[[ClothState], ClothState]) -> ClothState:
    """Closes the seams of a garment; returns its state unchanged if they are closed.

    Panels placed around the body are connected by edges that are many times too long. In plain dynamics these pull the
    cloth through itself and through the body. Here every step starts without velocity.

    Args:
        sheet: The cloth.
        state: The state to start from.
        step: Takes a short step; the velocities of its result are discarded.
    """
    for _ in range(MAX_SEWING_STEPS):
        if largest_stretch(sheet, state.positions) < CLOSED_STRETCH:
            break
        state = step(state)
        state = replace(state, velocities=np.zeros_like(state.velocities), change=np.zeros_like(state.change))
    return state


def largest_stretch(sheet: Sheet, positions: Positions) -> float:
    """Returns the largest stretch of an edge, as a factor."""
    ends = positions[sheet.edges]
    return float((np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) / sheet.edge_length).max())
