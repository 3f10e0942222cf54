"""Seams that are still open at the start: closed without haste, so that nothing is pulled through anything."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from .dressed_body import DressedBody
from .frame_end import FrameEnd
from .sheet import Sheet
from .state import ClothState, Positions

if TYPE_CHECKING:
    from hemline.motions.motion import Pose

CLOSED = 1.5
"""Greatest stretch of an edge from which the garment is taken to be sewn up, as a factor."""

STEP = 1 / 240
"""Length of a step; after each the cloth stands still [s]."""

MOST = 400
"""Steps, at most."""


def sewn(dressed: DressedBody, end: FrameEnd, pose: "Pose", state: ClothState) -> ClothState:
    """The garment with its seams closed; as it is where they are.

    Panels that are laid around the body hang together by edges that are many times too long. Left to dynamics, these
    pull the cloth through itself and through the body. Here every step starts from standing still.

    Args:
        dressed: The garment on its body.
        end: Pushes the cloth out of the body after each step.
        pose: The body's pose.
        state: Where the cloth is.

    Raises:
        SimulationFailed: A step failed at its shortest.
    """
    for _ in range(MOST):
        if stretch(dressed.sheet, state.positions) < CLOSED:
            break
        state, _, posed = dressed.frame(state, pose, pose, substeps=1, seconds=STEP)
        cleaned = end.clean(posed, state.positions, STEP, state.sides)
        state = dressed.fed_back(state, cleaned.positions, cleaned.pinched)
        state = replace(state, velocities=np.zeros_like(state.velocities), change=np.zeros_like(state.change))
    return state


def stretch(sheet: Sheet, positions: Positions) -> float:
    """The largest stretch of an edge, as a factor."""
    ends = positions[sheet.edges]
    return float((np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) / sheet.edge_length).max())
