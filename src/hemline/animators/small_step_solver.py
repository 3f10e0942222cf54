"""Moves a proxy in small steps: four to six times as fast as `newton_solver`, but the cloth may pass through itself."""

from dataclasses import replace

import numpy as np

from hemline.bodies import PosedBody, ShapedBody
from hemline.garments import Garment
from hemline.motions.motion import Pose
from hemline.sim.cloth.sheet import Positions
from hemline.sim.cloth.wind import Wind
from hemline.sim.settings import SimSettings
from hemline.sim.small_steps.spring_cloth import SpringCloth, SpringState

from .rigid_transform import RigidTransform


class SmallStepSolver:
    """Moves a proxy in small steps.

    Args:
        garment: The proxy, on this shape.
        shaped: The body.
        settings: Settings of the simulator.
        wind: Wind over time and place; None for that of the settings.
    """

    def __init__(self, garment: Garment, shaped: ShapedBody, settings: SimSettings, wind: Wind | None):
        self._shaped, self._garment = shaped, garment
        self._cloth = SpringCloth(garment, shaped, settings, wind)
        self._hard = np.isinf(garment.pins.stiffness)
        self._last: tuple[Pose, PosedBody] | None = None

    def start(self, positions: Positions) -> SpringState:
        """Returns the cloth at rest, see `ProxySolver`."""
        return self._cloth.start(positions)

    def advance(self, cloth: SpringState, first: Pose, second: Pose, seconds: float) -> SpringState:
        """Returns the cloth after a frame, see `ProxySolver`."""
        # the second pose of a frame is the first of the next
        known = self._last is not None and self._last[0] is first
        before = self._last[1] if known and self._last is not None else self._shaped.posed(first)
        after = self._shaped.posed(second)
        self._last = second, after
        return self._cloth.advance(cloth, before, after, seconds)

    def place(
        self, cloth: SpringState, positions: Positions, velocities: Positions, posed: PosedBody, seconds: float
    ) -> SpringState:
        """Returns cloth that was carried, see `ProxySolver`. Cloth inside the body leaves it as it moves on."""
        positions, pins = positions.copy(), self._garment.pins
        positions[pins.vertices[self._hard]] = np.asarray(pins.on(posed), np.float64)[self._hard]
        return replace(self._cloth.start(positions), velocities=velocities, time=cloth.time + seconds)

    def move(self, cloth: SpringState, transform: RigidTransform) -> SpringState:
        """Returns the cloth with its velocities, moved rigidly."""
        return replace(
            cloth, positions=transform.points(cloth.positions), velocities=transform.vectors(cloth.velocities)
        )

    def stop(self, cloth: SpringState) -> SpringState:
        """Returns the cloth without its velocities."""
        return replace(cloth, velocities=np.zeros_like(cloth.velocities))
