"""State of the cloth, scene that drives it, and report of a step."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from hemline.sim.cloth.sheet import Positions
from hemline.sim.contact.body.surface import MovingSkin
from hemline.sim.contact.history.contact_history import HistoryFaces


@dataclass(frozen=True)
class ClothState:
    """The state of the cloth: all that the next step depends on.

    Attributes:
        positions: Positions of the vertices [m].
        velocities: Velocities of the vertices [m/s].
        change: Change of the velocities in the last step [m/s], which the next step uses for its prediction.
        load: Force with which the body pressed on each vertex in the last step [N].
        pinched: Vertices that cannot leave the body, because parts of it intersect there.
        contact_history: Faces of the body that keep each vertex off. None for cloth without a history, for example
            while it is being dressed or in a static solve; the closest skin then keeps it off.
        time: Time since the start [s].
    """

    positions: Positions
    velocities: Positions
    change: Positions
    load: Float[np.ndarray, " verts"]
    pinched: Bool[np.ndarray, " verts"]
    contact_history: HistoryFaces | None
    time: float = 0.0


@dataclass(frozen=True)
class StepScene:
    """The boundary conditions of the cloth at one moment: pins and body.

    Attributes:
        pinned: Positions of the pinned vertices [m].
        skin: The skin of the body, or None.
        joints: Joints of the body [m], or None.
    """

    pinned: Float[np.ndarray, "pins 3"]
    skin: MovingSkin | None = None
    joints: Float[np.ndarray, "joints 3"] | None = None


@dataclass(frozen=True)
class StepReport:
    """Residual and cost of a step.

    Attributes:
        residual_share: Mean residual force, divided by the mean weight of a vertex.
        newton_steps: Number of Newton steps.
        solver_steps: Number of steps of conjugate gradients in all Newton steps.
    """

    residual_share: float
    newton_steps: int
    solver_steps: int


class StepRejected(Exception):
    """A step has an unusable result; `Stepper.advance` then repeats it as two steps of half the length."""
