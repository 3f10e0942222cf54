"""All that can be chosen about a simulation, apart from garment, body and motion."""

import math
from dataclasses import dataclass

from hemline.errors import BadInput


@dataclass(frozen=True)
class SimSettings:
    """Settings of the simulator. All of them are part of a take's inputs.

    Raises:
        BadInput: A value that makes no sense, such as no substeps or a negative thickness.
    """

    fps: float = 30.0
    """Frames a second that are stored."""
    substeps: int = 4
    """Steps of backward Euler a frame; the body's pose is interpolated at each."""
    gravity: tuple[float, float, float] = (0.0, -9.81, 0.0)
    """[m/s^2]"""
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Wind, or its mean where there are gusts [m/s]."""
    gusts: float = 0.0
    """Standard deviation of each component of the wind; 0: it is constant [m/s]."""
    gust_length: float = 2.0
    """Distance over which gusts change [m]."""
    gust_seconds: float = 1.0
    """Time in which gusts change [s]."""
    gust_seed: int = 0
    """Which of all such gusts."""
    air_density: float = 1.2
    """[kg/m^3]"""
    thickness: float = 0.003
    """Distance that cloth keeps from the body [m]."""
    contact_stiffness: float = 4e5
    """Pressure over penetration of that distance [N/m^3]."""
    contact_depth: float = 0.01
    """Penetration from which the pressure stays constant [m]."""
    contact_reach: float = 0.04
    """How far from the body's vertices contact is looked for, inwards too [m]."""
    pinched_share: float = 0.02
    """Share of the contact stiffness that is left to another limb than the cloth's own where both are in each other."""
    self_contact: bool = True
    """Whether the cloth meets itself."""
    self_thickness: float = 0.002
    """Distance that cloth keeps from itself [m]; less where edges are shorter than twice that."""
    self_stiffness: float = 5e4
    """Pressure of cloth on cloth over penetration of that distance [N/m^3]."""
    creep: float = 0.002
    """Slip below which friction is smoothed [m/s]."""
    newton_steps: int = 6
    """Newton steps a substep, at most."""
    residual_share: float = 0.25
    """A substep is done when the mean residual force is below this share of a vertex's mean weight."""
    solver_share: float = 0.05
    """Conjugate gradients stop when the preconditioned residual has fallen to this share."""
    solver_steps: int = 150
    """Steps of conjugate gradients a Newton step, at most."""
    halvings: int = 5
    """How often a substep that fails is halved before the take is given up."""
    lead_in: float = 1.0
    """Time from the rest pose to the first pose of the clip [s]."""
    settle: float = 6.0
    """Cloth time that settling in the rest pose may take, at most [s]."""

    def __post_init__(self):
        for name in ("fps", "substeps", "contact_depth", "contact_reach", "creep", "newton_steps", "solver_steps"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise BadInput(f"setting '{name}' must be positive", getattr(self, name), "give a number above 0")
        for name in ("gust_length", "gust_seconds"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise BadInput(f"setting '{name}' must be positive", getattr(self, name), "give a number above 0")
        if isinstance(self.gust_seed, bool) or not isinstance(self.gust_seed, int) or self.gust_seed < 0:
            raise BadInput("setting 'gust_seed' must be a whole number", self.gust_seed, "give 0 or more")
        for name in (
            "gusts",
            "air_density",
            "thickness",
            "self_thickness",
            "contact_stiffness",
            "self_stiffness",
            "halvings",
            "lead_in",
            "settle",
        ):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) >= 0):
                raise BadInput(f"setting '{name}' must not be negative", getattr(self, name), "give 0 or more")
        for name in ("residual_share", "solver_share", "pinched_share"):
            if not 0 < getattr(self, name) < 1:
                raise BadInput(f"setting '{name}' must be a share", getattr(self, name), "give a number from 0 to 1")
        for name in ("gravity", "wind"):
            if len(getattr(self, name)) != 3 or not all(math.isfinite(v) for v in getattr(self, name)):
                raise BadInput(f"setting '{name}' must be a vector", getattr(self, name), "give three finite numbers")
