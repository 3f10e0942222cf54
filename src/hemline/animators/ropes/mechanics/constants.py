"""The constants of rope chains."""

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Literal, Self

import numpy as np

from hemline.errors import BadModel
from hemline.options import check_options, not_negative, positive

from .kernel_inputs import ContactSettings, StepSettings

if TYPE_CHECKING:
    from hemline.garments.material import Material

PUSH_OUT = ("gradient", "history", "slide")
"""Methods of pushing a node out of a collider; kernels take the index."""

POSITION_UPDATE = ("turn", "project")
"""Methods of keeping a node on the sphere of its rope; kernels take the index."""

AIR_DENSITY = 1.2
"""Density of air at 20 degrees Celsius and sea level [kg/m^3]."""
BALANCE_REACH = 0.1
"""`RopeConstants.balance_reach` of new fits [m]."""
_FORCES = (
    "drag",
    "air_drag",
    "air_lift",
    "lateral",
    "lateral_stretch",
    "shrink",
    "parent_damping",
    "rest_angle",
    "bend_damping",
    "lateral_damping",
    "root_damping",
    "balance_reach",
)
"""Names of the constants that follow gravity and wind in `RopeConstants.numbers`."""


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
    """Rate at which a node takes on the air's velocity, in whatever direction the cloth faces [1/s]."""
    air_drag: float = not_negative(2.0)
    """Drag of cloth that faces the air: half the air's density times a coefficient, over the cloth's density [1/m]."""
    air_lift: float = not_negative(0.2)
    """Lift of cloth that faces the air, along the cloth's normal; defined like `air_drag` [1/m]."""
    lateral: float = not_negative(100.0)
    """Springs between neighbouring chains towards the distance at rest: relative acceleration per metre [1/s^2]."""
    lateral_stretch: float = not_negative(1500.0)
    """Stiffness of those springs beyond the longest distance that the cloth between them allows [1/s^2]."""
    shrink: float = not_negative(14.0)
    """Springs that keep a rope from getting shorter than at rest [1/s^2]."""
    parent_damping: float = not_negative(7.0)
    """Rate at which a node takes on the velocity of the node above it [1/s]."""
    root_damping: float = not_negative(300.0)
    """Additional `parent_damping` of the node below a root; falls by a factor of e with each node from there [1/s]."""
    bend_damping: float = not_negative(100.0)
    """Rate at which a node takes on the mean velocity of the nodes above and below it [1/s]."""
    lateral_damping: float = not_negative(50.0)
    """Rate at which a node takes on the mean velocity of the nodes to both sides [1/s]."""
    rest_angle: float = not_negative(0.0)
    """Springs towards the rest angle between consecutive ropes [1/s^2]."""
    balance_reach: float = not_negative(0.0)
    """Distance from its place at rest at which a node that moves off its support keeps nothing of the balance; with 0
    it keeps all of it everywhere [m]."""
    friction: float = not_negative(0.5)
    """Coulomb's coefficient against the body [1]."""
    margin: float = not_negative(0.02)
    """Distance that nodes keep from the body's primitives, unless their own clearance is smaller [m]."""
    substep: float = positive(1 / 60)
    """Longest substep; short ropes and hard pulls lead to shorter ones [s]."""
    substep_limit: int = positive(16)
    """Largest number of substeps in a step of up to 1/24 s; longer steps get proportionally more [1]."""
    tension_sweeps: int = not_negative(0)
    """Gauss-Seidel sweeps from tip to root for the tensions; 0 solves directly [1]."""
    impulse_sweeps: int = not_negative(0)
    """Gauss-Seidel sweeps from root to tip for the impulses; 0 solves directly [1]."""
    position_push: Literal["gradient", "history", "slide"] = "slide"
    """How a node leaves a collider: along its gradient ("gradient"), back along the path ("history"), or back to where
    it entered and then along the surface ("slide")."""
    velocity_push: Literal["gradient", "history"] = "gradient"
    """Direction N of Eq. 14: the collider's gradient, or back along the path."""
    position_update: Literal["turn", "project"] = "turn"
    """How a node on a taut rope moves: turned about the node above, or straight on and then put back on the sphere."""
    teleport: float = positive(1.0)
    """Teleport distance: a key joint that moves further than this in one step, and faster than 30 m/s, carries the
    ropes along [m]."""

    def __post_init__(self) -> None:
        check_options(self, "rope constant", error=BadModel)

    @classmethod
    def of_material(cls, material: "Material", air_density: float = AIR_DENSITY) -> Self:
        r"""Returns the constants of ropes of a material: air and friction as the simulator has them.

        A triangle of area $A$ and mass $\sigma A$ feels $\rho A / 2$ times its drag and lift coefficients, so the rates
        are $\rho c / 2 \sigma$. The simulator has no drag that does not depend on the facing of the cloth.

        Args:
            material: The material of the garment.
            air_density: Density of the air in the simulation [kg/m^3].
        """
        rate = air_density / (2 * material.density)
        return cls(
            drag=0.0,
            air_drag=rate * material.drag,
            air_lift=rate * material.lift,
            friction=material.friction,
            balance_reach=BALANCE_REACH,
        )

    def numbers(self) -> np.ndarray:
        """Returns the constants of the forces (18,), in the order of `rope_force_kernels`."""
        return np.array([*self.gravity, *self.wind, *(getattr(self, name) for name in _FORCES)])

    def step_settings(self) -> StepSettings:
        """Returns all constants of a step in the form that kernels take."""
        project = POSITION_UPDATE.index(self.position_update) > 0
        return StepSettings(self.numbers(), self.tension_sweeps, self.impulse_sweeps, project, self.contact_settings())

    def contact_settings(self) -> ContactSettings:
        """Returns the constants of contact in the form that kernels take."""
        pushes = (float(PUSH_OUT.index(name)) for name in (self.position_push, self.velocity_push))
        return ContactSettings(float(self.friction), *pushes)

    def as_dict(self) -> dict[str, Any]:
        """Returns JSON-like values, as model files hold them."""
        return {name: list(value) if isinstance(value, tuple) else value for name, value in asdict(self).items()}
