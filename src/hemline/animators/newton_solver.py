"""Moves a proxy by the offline simulator: backward Euler and Newton's method, exact and slow."""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hemline.bodies import PosedBody, ShapedBody
from hemline.collide import ProjectorState
from hemline.garments import Garment
from hemline.motions.motion import Pose
from hemline.sim.cloth.sheet import Positions
from hemline.sim.cloth.wind import Wind
from hemline.sim.settings import SimSettings
from hemline.sim.step.dressed_body import DressedBody
from hemline.sim.step.frame_end import FrameEnd
from hemline.sim.step.state import ClothState

from .proxy_solver import FRAME_SECONDS
from .rigid_transform import RigidTransform

STEP_HALVINGS = 3
"""Number of times that a failing step is halved before the cloth is carried instead."""


def newton_settings(*, exact: bool = False, **others: Any) -> SimSettings:
    """Returns settings of the simulator with which a proxy of 1,000 vertices takes some 20 ms a frame.

    Args:
        exact: Whether to take more steps to a smaller residual, at more than twice the time.
        others: Further settings.
    """
    substeps, residual_share = (4, 0.25) if exact else (2, 0.6)
    return SimSettings(substeps=substeps, residual_share=residual_share, halvings=STEP_HALVINGS, **others)


@dataclass(frozen=True, eq=False)
class NewtonCloth:
    """A proxy at the end of a frame."""

    cloth: ClothState
    """The cloth."""
    projector: ProjectorState
    """State of the projection at the end of each frame."""

    @property
    def positions(self) -> Positions:
        """Positions (verts, 3) [m]."""
        return self.cloth.positions

    @property
    def velocities(self) -> Positions:
        """Velocities (verts, 3) [m/s]."""
        return self.cloth.velocities


class NewtonSolver:
    """Moves a proxy by the offline simulator.

    Args:
        garment: The proxy, on this shape.
        shaped: The body.
        settings: Settings of the simulator.
        wind: Wind over time and place; None for that of the settings.
    """

    def __init__(self, garment: Garment, shaped: ShapedBody, settings: SimSettings, wind: Wind | None):
        self.settings = settings
        self._dressed = DressedBody(garment, shaped, settings, wind)
        self._end = FrameEnd(garment, shaped)

    def start(self, positions: Positions) -> NewtonCloth:
        """Returns the cloth at rest, see `ProxySolver`."""
        return NewtonCloth(self._dressed.stepper.start(positions), self._end.start())

    def advance(self, cloth: NewtonCloth, first: Pose, second: Pose, seconds: float) -> NewtonCloth:
        """Returns the cloth after a frame, see `ProxySolver` and `sim/takes/simulate.py`."""
        substeps = max(1, math.ceil(self.settings.substeps * seconds / FRAME_SECONDS - 1e-3))
        frame = self._dressed.simulate_frame(cloth.cloth, first, second, substeps=substeps, seconds=seconds)
        after = frame.state
        cleaned = self._end.clean(
            frame.posed, after.positions, seconds, after.contact_history, projector=cloth.projector
        )
        return NewtonCloth(self._dressed.apply_projection(frame, cleaned), cleaned.projector)

    def place(
        self, cloth: NewtonCloth, positions: Positions, velocities: Positions, posed: PosedBody, seconds: float
    ) -> NewtonCloth:
        """Returns cloth that was carried, pushed out of the body, see `ProxySolver`."""
        model, pins = self._dressed.model, self._dressed.scene(posed).pinned
        positions = positions.copy()
        positions[model.pinned] = pins[model.hard]
        cleaned = self._end.clean(posed, positions, seconds, projector=cloth.projector)
        placed = self._dressed.stepper.start(np.where(model.fixed[:, None], positions, cleaned.positions))
        placed = replace(placed, velocities=velocities, time=cloth.cloth.time + seconds)
        return NewtonCloth(placed, cleaned.projector)

    def move(self, cloth: NewtonCloth, transform: RigidTransform) -> NewtonCloth:
        """Returns the cloth with its velocities, moved rigidly."""
        state = cloth.cloth
        moved = replace(
            state,
            positions=transform.points(state.positions),
            velocities=transform.vectors(state.velocities),
            change=transform.vectors(state.change),
        )
        return replace(cloth, cloth=moved)

    def stop(self, cloth: NewtonCloth) -> NewtonCloth:
        """Returns the cloth without its velocities."""
        still = np.zeros_like(cloth.positions)
        return replace(cloth, cloth=replace(cloth.cloth, velocities=still, change=still))
