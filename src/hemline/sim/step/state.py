"""What a step starts from, what drives it, and how it went."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from hemline.sim.cloth.sheet import Positions
from hemline.sim.contact.body.surface import MovingSkin
from hemline.sim.contact.history.contact_history import HistoryFaces


@dataclass(frozen=True)
class ClothState:
    """All that the next step depends on.

    Attributes:
        positions: [m]
        velocities: [m/s]
        change: Of the velocities in the last step [m/s]; where the next step starts to look.
        load: Force with which the body pressed on each vertex in the last step [N].
        pinched: Vertices that have no free place, as the body cuts through itself there.
        contact_history: Where the body held each vertex off. None: the cloth has no past, as where it is dressed or no
            time passes, and the body holds it off from where it is closest.
        time: Since the start [s].
    """

    positions: Positions
    velocities: Positions
    change: Positions
    load: Float[np.ndarray, " verts"]
    pinched: Bool[np.ndarray, " verts"]
    contact_history: HistoryFaces | None
    time: float = 0.0


@dataclass(frozen=True)
class Scene:
    """What drives the cloth, at one moment.

    Attributes:
        pinned: Positions of the pinned vertices [m].
        skin: The body's surface, or None.
        joints: Its joints, or None [m].
    """

    pinned: Float[np.ndarray, "pins 3"]
    skin: MovingSkin | None = None
    joints: Float[np.ndarray, "joints 3"] | None = None


@dataclass(frozen=True)
class StepReport:
    """How a step went.

    Attributes:
        residual_share: Mean residual force over the mean weight of a vertex.
        newton_steps: Newton steps taken.
        solver_steps: Steps of conjugate gradients in all of them.
    """

    residual_share: float
    newton_steps: int
    solver_steps: int


class StepRejected(Exception):
    """A step whose result cannot be used; it is tried again in halves."""
