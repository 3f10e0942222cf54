"""Seams that are still open at the start: closed without haste, so that nothing is pulled through anything."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from hemline.sim.cloth.sheet import Positions, Sheet
from hemline.sim.step.state import ClothState

CLOSED_STRETCH = 1.5
"""Greatest stretch of an edge from which the garment is taken to be sewn up, as a factor."""

MAX_SEWING_STEPS = 400
"""Steps, at most."""


def sew(sheet: Sheet, state: ClothState, step: Callable[[ClothState], ClothState]) -> ClothState:
    """The garment with its seams closed; as it is where they are.

    Panels that are laid around the body hang together by edges that are many times too long. Left to dynamics, these
    pull the cloth through itself and through the body. Here every step starts from standing still.

    Args:
        sheet: The cloth.
        state: Where it is.
        step: The cloth after a short step; its velocities are taken away.
    """
    for _ in range(MAX_SEWING_STEPS):
        if largest_stretch(sheet, state.positions) < CLOSED_STRETCH:
            break
        state = step(state)
        state = replace(state, velocities=np.zeros_like(state.velocities), change=np.zeros_like(state.change))
    return state


def largest_stretch(sheet: Sheet, positions: Positions) -> float:
    """The largest stretch of an edge, as a factor."""
    ends = positions[sheet.edges]
    return float((np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) / sheet.edge_length).max())
