"""Damped dynamics at one pose, which bring cloth near its equilibrium: seams are closed first, tangles are ironed."""

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Mask
from hemline.errors import SimulationFailed
from hemline.meshes import crossing_edges
from hemline.sim.cloth.sheet import Positions
from hemline.sim.settings import SimSettings
from hemline.sim.step.dressed_body import DressedBody
from hemline.sim.step.frame_end import FrameEnd
from hemline.sim.step.state import ClothState

from .ironing import IRONING_INTERVAL, MAX_IRONINGS, iron
from .sewing import CLOSED_STRETCH, largest_stretch, sew

if TYPE_CHECKING:
    from hemline.bodies import PosedBody

SEAM_STEP = 1 / 240
"""Length of a step while seams close [s]."""

STILL_SPEED = 0.02
"""Mean speed below which the cloth counts as near enough to its equilibrium [m/s]."""

NO_EDGES = np.empty((0, 2), np.int32)


def run_damped(
    dressed: DressedBody,
    end: FrameEnd,
    posed: "PosedBody",
    positions: Positions,
    *,
    seconds: float,
    velocity_ratio: float,
    still: float = STILL_SPEED,
    on_step: Callable[[], None] | None = None,
) -> ClothState:
    """Simulates the cloth at one pose; with damping, until it hardly moves.

    Args:
        dressed: The garment on its body.
        end: Pushes the cloth out of the body after each frame.
        posed: The body.
        positions: Positions of the cloth [m].
        seconds: Maximum time of the cloth [s].
        velocity_ratio: Fraction of the velocities that is kept from frame to frame. With 1 there is no damping, no
            ironing, and no end before the time is over.
        still: Mean speed below which the dynamics end [m/s].
        on_step: Called before each frame; it may raise.

    Raises:
        SimulationFailed: A step failed at its shortest.
    """
    settings = dressed.settings
    state, step, frames, irons = dressed.stepper.start(positions), 1 / settings.fps, round(seconds * settings.fps), 0
    # cloth that is being dressed looks for the closest places, whatever held it off before
    state = replace(state, contact_history=None) if velocity_ratio < 1 else state
    projector = end.start()

    def still_frame(state: ClothState, seconds: float, substeps: int | None) -> ClothState:
        nonlocal projector
        if on_step:
            on_step()
        frame = dressed.simulate_frame(state, posed.pose, posed.pose, substeps=substeps, seconds=seconds)
        cleaned = end.clean(posed, frame.state.positions, seconds, frame.state.contact_history, projector=projector)
        projector = cleaned.projector
        return dressed.apply_projection(frame, cleaned)

    try:
        state = sew(dressed.sheet, state, lambda now: still_frame(now, SEAM_STEP, 1))
        for frame in range(frames):
            state = still_frame(state, step, 2 if velocity_ratio < 1 else None)
            state = replace(state, velocities=velocity_ratio * state.velocities, change=velocity_ratio * state.change)
            speed = float(np.linalg.norm(state.velocities, axis=1).mean())
            quiet = velocity_ratio < 1 and frame > 5 and speed < still
            due = velocity_ratio < 1 and (quiet or frame % IRONING_INTERVAL == IRONING_INTERVAL - 1)
            crossed = free_crossings(dressed, state.positions, state.pinched, settings) if due else NO_EDGES
            # ironed cloth needs time to fall; cloth that keeps crossing itself has no better place
            if len(crossed) and irons < MAX_IRONINGS and frame + IRONING_INTERVAL < frames:
                irons += 1
                state = replace(state, positions=_iron(dressed, state, crossed))
            elif quiet:
                break
    except SimulationFailed as reason:
        raise SimulationFailed(f"settling '{dressed.garment.name}': {reason}") from reason
    return _iron_once_more(dressed, state, settings) if velocity_ratio < 1 else state


def free_crossings(dressed: DressedBody, positions: Positions, pinched: Mask, settings: SimSettings) -> np.ndarray:
    """Returns the edges (edges, 2) that cross the cloth away from pinched vertices; none without self-contact."""
    if not settings.self_contact:
        return NO_EDGES
    crossed = crossing_edges(positions.astype(np.float32), dressed.garment.faces)
    return crossed[~pinched[crossed].any(axis=1)]


def _iron_once_more(dressed: DressedBody, state: ClothState, settings: SimSettings) -> ClothState:
    """Irons the remaining crossings once more, unless that stretches the cloth too far.

    A take starts better with folds pressed flat than with folds that go through each other.
    """
    crossed = free_crossings(dressed, state.positions, state.pinched, settings)
    if not len(crossed):
        return state
    flat = _iron(dressed, state, crossed)
    return replace(state, positions=flat) if largest_stretch(dressed.sheet, flat) < CLOSED_STRETCH else state


def _iron(dressed: DressedBody, state: ClothState, crossed: np.ndarray) -> Positions:
    return iron(dressed.sheet, state.positions, crossed, ~state.pinched & ~dressed.pinned)
