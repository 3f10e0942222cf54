"""The numbers that rope chains run on."""

from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np

from hemline.errors import BadModel
from hemline.options import check_options, not_negative, positive

PUSH_OUT = ("gradient", "history", "slide")
"""Ways out of a collider, in the order of the kernels."""

POSITION_UPDATE = ("turn", "project")
"""Ways to keep a node on the sphere of its rope, in the order of the kernels."""

_FORCES = (
    "drag",
    "air_drag",
    "air_lift",
    "lateral",
    "lateral_stretch",
    "shrink",
    "parent_damping",
    "rest_angle",
    "friction",
    "margin",
    "bend_damping",
    "lateral_damping",
    "root_damping",
)
"""Numbers of the force kernels after gravity and wind, in their order."""


@dataclass(frozen=True)
class RopeConstants:
    """Constants of the dynamics. Spring constants saturate in the kernels, so that none can make a step unstable.

    Raises:
        BadModel: A constant of another type, negative, not finite, or an unknown choice.
    """

    gravity: tuple[float, float, float] = (0.0, -9.81, 0.0)
    """Acceleration of free fall [m/s^2]."""
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Velocity of the air [m/s]."""
    drag: float = not_negative(1.0)
    """Rate at which a node takes on the air's velocity, whichever way the cloth faces [1/s]."""
    air_drag: float = not_negative(2.0)
    """Drag of cloth that faces the air: half the air's density times a coefficient, over the cloth's density [1/m]."""
    air_lift: float = not_negative(0.2)
    """The same for the force along the cloth's normal [1/m]."""
    lateral: float = not_negative(100.0)
    """Springs between neighbouring chains towards the distance at rest: relative acceleration per metre [1/s^2]."""
    lateral_stretch: float = not_negative(1500.0)
    """The same beyond the longest distance that the cloth between them allows [1/s^2]."""
    shrink: float = not_negative(14.0)
    """Springs that keep a rope from getting shorter than at rest [1/s^2]."""
    parent_damping: float = not_negative(7.0)
    """Rate at which a node takes on the velocity of the node above it [1/s]."""
    root_damping: float = not_negative(300.0)
    """The same for the node below a root, in addition; e times less with each node from there [1/s]."""
    bend_damping: float = not_negative(100.0)
    """Rate at which a node takes on the mean velocity of the nodes above and below it [1/s]."""
    lateral_damping: float = not_negative(50.0)
    """Rate at which a node takes on the mean velocity of the nodes to both sides [1/s]."""
    rest_angle: float = not_negative(0.0)
    """Springs towards the rest angle between consecutive ropes [1/s^2]."""
    friction: float = not_negative(0.5)
    """Coulomb's coefficient against the body [1]."""
    margin: float = not_negative(0.02)
    """Distance that nodes keep from the body's primitives, unless their own clearance is smaller [m]."""
    substep: float = positive(1 / 60)
    """Longest substep [s]; short ropes and hard pulls take shorter ones by themselves."""
    substep_limit: int = positive(16)
    """Most substeps in one step of up to 1/24 s; longer steps get proportionally more [1]."""
    tension_sweeps: int = not_negative(0)
    """Gauss-Seidel sweeps from tip to root for the tensions; 0 solves directly [1]."""
    impulse_sweeps: int = not_negative(0)
    """Gauss-Seidel sweeps from root to tip for the impulses; 0 solves directly [1]."""
    position_push: Literal["gradient", "history", "slide"] = "slide"
    """Way out of a collider: its gradient; back along the path; or back to where it entered, then along the surface."""
    velocity_push: Literal["gradient", "history"] = "gradient"
    """Direction N of Eq. 14: the gradient, or back along the path."""
    position_update: Literal["turn", "project"] = "turn"
    """A node on a taut rope is turned about the node above; or goes straight on and is put back on the sphere."""
    teleport: float = positive(1.0)
    """A jump of the key joint further than this in one step, and faster than 30 m/s, carries the ropes along [m]."""

    def __post_init__(self) -> None:
        check_options(self, "rope constant", error=BadModel)

    def numbers(self) -> np.ndarray:
        """The constants in the order of the force kernels."""
        return np.array([*self.gravity, *self.wind, *(getattr(self, name) for name in _FORCES)])

    def choices(self) -> np.ndarray:
        """The choices in the order of the step kernel."""
        ways = PUSH_OUT.index(self.position_push), PUSH_OUT.index(self.velocity_push)
        ways += (POSITION_UPDATE.index(self.position_update),)
        return np.array([self.tension_sweeps, self.impulse_sweeps, *ways], np.int32)

    def as_dict(self) -> dict[str, Any]:
        """JSON-like values, as files hold them."""
        return {name: list(value) if isinstance(value, tuple) else value for name, value in asdict(self).items()}
