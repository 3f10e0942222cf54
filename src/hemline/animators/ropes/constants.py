"""The numbers that rope chains run on."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from difflib import get_close_matches
from typing import Any, Literal

import numpy as np

from hemline.errors import BadModel

PUSH_OUT = ("gradient", "history", "slide")
"""Ways out of a collider, in the order of the kernels."""

_NONNEGATIVE = (
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
)


@dataclass(frozen=True)
class RopeConstants:
    """Constants of the dynamics. Spring constants saturate in the kernels, so that none can make a step unstable.

    Raises:
        BadModel: A constant is negative, not finite, or an unknown choice.
    """

    gravity: tuple[float, float, float] = (0.0, -9.81, 0.0)
    """Acceleration of free fall [m/s^2]."""
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Velocity of the air [m/s]."""
    drag: float = 1.0
    """Rate at which a node takes on the air's velocity, whichever way the cloth faces [1/s]."""
    air_drag: float = 4.0
    """Drag of cloth that faces the air: half the air's density times a coefficient, over the cloth's density [1/m]."""
    air_lift: float = 1.0
    """The same for the force along the cloth's normal [1/m]."""
    lateral: float = 20.0
    """Springs between neighbouring chains towards the distance at rest: relative acceleration per metre [1/s^2]."""
    lateral_stretch: float = 800.0
    """The same beyond the longest distance that the cloth between them allows [1/s^2]."""
    shrink: float = 0.3
    """Springs that keep a rope from getting shorter than at rest [1/s^2]."""
    parent_damping: float = 0.25
    """Rate at which a node takes on the velocity of the node above it [1/s]."""
    rest_angle: float = 0.0
    """Springs towards the rest angle between consecutive ropes [1/s^2]."""
    friction: float = 0.3
    """Coulomb's coefficient against the body [1]."""
    margin: float = 0.003
    """Distance that nodes keep from the body's primitives [m]."""
    substep: float = 1 / 60
    """Longest substep [s]; short ropes and hard pulls take shorter ones by themselves."""
    substep_limit: int = 16
    """Most substeps in one step of up to 1/24 s; longer steps get proportionally more [1]."""
    tension_sweeps: int = 0
    """Gauss-Seidel sweeps from tip to root for the tensions; 0 solves directly [1]."""
    impulse_sweeps: int = 0
    """Gauss-Seidel sweeps from root to tip for the impulses; 0 solves directly [1]."""
    position_push: Literal["gradient", "history", "slide"] = "slide"
    """Way out of a collider: its gradient; back along the path; or back to where it entered, then along the surface."""
    velocity_push: Literal["gradient", "history"] = "gradient"
    """Direction N of Eq. 14: the gradient, or back along the path."""
    teleport: float = 1.0
    """A jump of the key joint further than this in one step, and faster than 30 m/s, carries the ropes along [m]."""

    def __post_init__(self) -> None:
        for name in ("gravity", "wind"):
            vector = tuple(float(each) for each in getattr(self, name))
            object.__setattr__(self, name, vector)
            _check(len(vector) == 3 and bool(np.isfinite(vector).all()), name, vector, "give three finite numbers")
        for name in _NONNEGATIVE:
            value = getattr(self, name)
            _check(bool(np.isfinite(value)) and value >= 0, name, value, "give a finite number of at least 0")
        for name in ("substep", "teleport", "substep_limit"):
            value = getattr(self, name)
            _check(bool(np.isfinite(value)) and value > 0, name, value, "give a finite number above 0")
        for name in ("tension_sweeps", "impulse_sweeps"):
            _check(int(getattr(self, name)) >= 0, name, getattr(self, name), "give 0 for the direct solve, or a count")
        _check(self.position_push in PUSH_OUT, "position_push", self.position_push, f"use one of {', '.join(PUSH_OUT)}")
        _check(self.velocity_push in PUSH_OUT[:2], "velocity_push", self.velocity_push, "use gradient or history")

    def numbers(self) -> np.ndarray:
        """The constants in the order of the force kernels."""
        return np.array([*self.gravity, *self.wind, *(getattr(self, name) for name in _NONNEGATIVE)])

    def choices(self) -> np.ndarray:
        """The choices in the order of the step kernel."""
        ways = PUSH_OUT.index(self.position_push), PUSH_OUT.index(self.velocity_push)
        return np.array([self.tension_sweeps, self.impulse_sweeps, *ways], np.int32)

    def as_dict(self) -> dict[str, Any]:
        """JSON-like values, as files hold them."""
        return {name: list(value) if isinstance(value, tuple) else value for name, value in asdict(self).items()}

    @classmethod
    def of(cls, values: Mapping[str, Any]) -> "RopeConstants":
        """The constants that `as_dict` gave.

        Raises:
            BadModel: An unknown name, or a value that cannot be used.
        """
        known = [field.name for field in fields(cls)]
        for name in values:
            if name not in known:
                near = get_close_matches(name, known, 1)
                raise BadModel(
                    "unknown rope constant",
                    f"'{name}'",
                    f"did you mean '{near[0]}'" if near else f"use {', '.join(known)}",
                )
        try:
            given: dict[str, Any] = {
                name: tuple(value) if isinstance(value, list) else value for name, value in values.items()
            }
            return cls(**given)
        except TypeError as error:
            raise BadModel("rope constants must be numbers", error, "make the file again") from error


def _check(right: bool, name: str, got: object, cure: str) -> None:
    if not right:
        raise BadModel(f"rope constant '{name}' cannot be used", got, cure)
