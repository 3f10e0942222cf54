"""All that moves in rope chains: plain arrays, copied freely."""

from dataclasses import dataclass, fields, replace

import numpy as np

from hemline.animators.leaps import Rigid
from hemline.arrays import Bool, Float, Nodes


@dataclass(frozen=True, eq=False)
class RopesState:
    """Ropes at one moment. All float64 but the flags."""

    positions: Nodes
    """Nodes in the world [m]."""
    velocities: Nodes
    """Their velocities [m/s]."""
    tensions: Float[np.ndarray, " nodes"]
    """Tension of the rope above each node [N]: where the next step's sweeps start."""
    touched: Bool[np.ndarray, " nodes"]
    """Nodes that were pushed out of the body in the last step."""
    frames: Float[np.ndarray, "joints 3 4"]
    """Skin transforms of the body in the last step."""
    kinematic_velocities: Float[np.ndarray, "kin 3"]
    """Velocities of the kinematic nodes at this moment [m/s]."""
    kinematic_rates: Float[np.ndarray, "kin 3"]
    """Their mean velocities over the last step [m/s]."""
    last_dt: Float[np.ndarray, ""]
    """Length of the last step [s]; 0 before the first one, and after a teleport: no history."""
    kinematic_rest: Float[np.ndarray, "kin 3"]
    """Kinematic nodes at rest on this body's shape [m]."""
    shapes: Float[np.ndarray, "prims 16"]
    """Primitives of this body's shape at rest [m]."""
    centres: Float[np.ndarray, "prims 4"]
    """Balls around them at rest [m]."""
    pivots: Float[np.ndarray, "joints 3"]
    """Joints of this body's shape at rest [m]."""

    def moved_along(self, way: Rigid) -> "RopesState":
        """The same state turned and shifted as a whole, its past too."""
        return replace(
            self,
            positions=way.points(self.positions),
            velocities=way.vectors(self.velocities),
            frames=way.frames(self.frames),
            kinematic_velocities=way.vectors(self.kinematic_velocities),
            kinematic_rates=way.vectors(self.kinematic_rates),
        )

    def copy(self) -> "RopesState":
        """The same state in arrays of its own."""
        return replace(self, **{field.name: getattr(self, field.name).copy() for field in fields(self)})
