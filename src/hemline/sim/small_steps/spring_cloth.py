"""A garment on a body, simulated in small steps: fast and rough where `sim.step` is slow and exact."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Int
from hemline.collide.surface.garment_on_body import GarmentOnBody
from hemline.collide.surface.posed_surface import PosedSurface
from hemline.errors import SimulationFailed
from hemline.sim.cloth.sheet import Positions
from hemline.sim.cloth.wind import Wind, wind_of
from hemline.sim.settings import SimSettings
from hemline.sim.step.dressed_body import make_garment_sheet

from .force_kernels import Surroundings
from .skin_push_kernels import MovingBody, PushSettings, SkinPlaces
from .spring_sheet import spring_sheet
from .step_kernels import FrameSettings, PinTargets, StepCloth, advance_frame

if TYPE_CHECKING:
    from hemline.bodies import PosedBody, ShapedBody
    from hemline.garments.garment import Garment

FRAME_SECONDS = 1 / 30
"""Length of the frame that has `SimSettings.substeps` steps [s]."""
HELD_SECONDS = 0.008
"""Time for which forces of air and bending are kept [s]."""
VISCOSITY = 15.0
"""Rate at which the velocities of the ends of an edge become alike [1/s]."""
NEAR = 0.1
"""Distance from the skin up to which a vertex may touch it within a frame [m]."""
RELEASE_SPEED = 1.0
"""Speed with which cloth that was inside the body leaves it [m/s]."""


@dataclass(frozen=True, eq=False)
class SpringState:
    """The cloth at the end of a frame; never changed in place."""

    positions: Positions
    """Positions [m]."""
    velocities: Positions
    """Velocities [m/s]."""
    faces: Int[np.ndarray, " verts"]
    """Face of the skin next to each vertex, in the order of the kernels; -1 where none is near."""
    time: float = 0.0
    """Time since the start [s]."""


class SpringCloth:
    """A garment on one shape of the body, simulated in small steps.

    Point masses with springs along the edges of the garment take many short steps, each solved by one sweep over the
    springs. In a frame the skin moves evenly from its first pose to its second.

    Args:
        garment: The garment, on this shape.
        shaped: The body.
        settings: Settings of the simulator; those of Newton's method, of damping and of self-contact play no part.
        wind: Wind over time and place; None for that of the settings.

    Source: Macklin et al., "Small steps in physics simulation", SCA 2019, Algorithm 1. Differs: forces of the air and
        of bending (explicit, kept for 8 ms) are not constraints; contact is with the tangent plane at the nearest
        place of the skin, which is followed from step to step.
    """

    def __init__(self, garment: "Garment", shaped: "ShapedBody", settings: SimSettings, wind: Wind | None = None):
        self.garment, self.shaped, self.settings = garment, shaped, settings
        self.on_body = GarmentOnBody.of(shaped, garment.vertices)
        pins, order = garment.pins, self.on_body.order
        self.sheet = spring_sheet(make_garment_sheet(garment), pins.vertices, pins.stiffness, order)
        self._hard = np.isinf(pins.stiffness)
        self._wind = wind_of(settings) if wind is None else wind

    def start(self, positions: Positions) -> SpringState:
        """Returns the cloth at rest.

        Args:
            positions: Where it is (verts, 3) [m].
        """
        return SpringState(positions, np.zeros_like(positions), np.full(len(positions), -1, np.int32))

    def advance(self, state: SpringState, before: "PosedBody", after: "PosedBody", seconds: float) -> SpringState:
        """Returns the cloth after a frame.

        Args:
            state: The cloth at the first pose.
            before: The body at the start of the frame.
            after: The body at its end.
            seconds: Length of the frame [s].

        Raises:
            SimulationFailed: A position is not finite.
        """
        order, origin = self.on_body.order, before.joints[0].astype(np.float64)
        steps = max(1, math.ceil(self.settings.substeps * seconds / FRAME_SECONDS - 1e-3))
        frame = np.hstack([np.eye(3), origin[:, None]])
        first, second = (PosedSurface.at(self.on_body.patches, frame, each.vertices).skin for each in (before, after))
        pins, hard = [np.asarray(self.garment.pins.on(each), np.float64) for each in (before, after)], self._hard
        pins[0][hard] = state.positions[self.garment.pins.vertices[hard]]
        count = len(order)
        cloth = StepCloth(
            (state.positions[order] - origin).astype(np.float32),
            state.velocities[order].astype(np.float32),
            np.empty((count, 3), np.float32),
        )
        contact = SkinPlaces(
            state.faces.copy(),
            np.empty((count, 2), np.float32),
            np.empty(count, np.float32),
            np.empty((count, 3), np.float32),
            np.empty(count, np.int32),
        )
        advance_frame(
            self.sheet,
            self.on_body.nearest,
            MovingBody(first, second, second._replace(body=np.empty_like(second.body))),
            PinTargets(*((each - origin).astype(np.float32) for each in pins)),
            self._wind(state.time, state.positions)[order].astype(np.float32),
            self._frame_settings(steps, seconds / steps),
            contact,
            cloth,
        )
        positions, velocities = np.empty_like(state.positions), np.empty_like(state.velocities)
        positions[order] = cloth.positions + origin
        velocities[order] = cloth.velocities
        if not np.isfinite(positions).all():
            raise SimulationFailed("positions of the cloth must be finite", "NaN or infinity", "use a lighter motion")
        return SpringState(positions, velocities, contact.faces, state.time + seconds)

    def _frame_settings(self, steps: int, seconds: float) -> FrameSettings:
        settings = self.settings
        return FrameSettings(
            steps,
            np.float32(seconds),
            max(1, round(HELD_SECONDS / seconds)),
            Surroundings(
                (np.float32(settings.gravity[0]), np.float32(settings.gravity[1]), np.float32(settings.gravity[2])),
                np.float32(0.5 * settings.air_density),
                np.float32(VISCOSITY),
            ),
            PushSettings(np.float32(settings.thickness), np.float32(NEAR), np.float32(RELEASE_SPEED * seconds)),
        )
