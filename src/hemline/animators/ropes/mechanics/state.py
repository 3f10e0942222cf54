"""The state of rope chains: plain arrays that can be copied freely."""

from dataclasses import dataclass, fields, replace

import numpy as np

from hemline.animators.rigid_transform import RigidTransform
from hemline.arrays import Bool, Float, Nodes


@dataclass(frozen=True, eq=False)
class RopesState:
    """Ropes at one moment. All arrays are float64 but for the flags."""

    positions: Nodes
    """Nodes in the world [m]."""
    velocities: Nodes
    """Velocities of the nodes [m/s]."""
    tensions: Float[np.ndarray, " nodes"]
    """Tension of the rope above each node, from which the next step's sweeps start [N]."""
    touched: Bool[np.ndarray, " nodes"]
    """Nodes that were pushed out of the body in the last step."""
    frames: Float[np.ndarray, "joints 3 4"]
    """Skin transforms of the body in the last step."""
    kinematic_velocities: Float[np.ndarray, "kin 3"]
    """Velocities of the kinematic nodes at this moment [m/s]."""
    kinematic_rates: Float[np.ndarray, "kin 3"]
    """Mean velocities of the kinematic nodes over the last step [m/s]."""
    last_dt: Float[np.ndarray, ""]
    """Length of the last step; 0 without history, before the first step and after a teleport [s]."""
    kinematic_rest: Float[np.ndarray, "kin 3"]
    """Kinematic nodes at rest on this body's shape [m]."""
    shapes: Float[np.ndarray, "prims 16"]
    """Primitives of this body's shape at rest [m]."""
    centres: Float[np.ndarray, "prims 4"]
    """Bounding balls of the primitives at rest: centre and radius [m]."""
    pivots: Float[np.ndarray, "joints 3"]
    """Joints of this body's shape at rest [m]."""

    def relocate(self, motion: RigidTransform) -> "RopesState":
        """Returns the state rotated and translated as a whole, history included."""
        return replace(
            self,
            positions=motion.points(self.positions),
            velocities=motion.vectors(self.velocities),
            frames=motion.frames(self.frames),
            kinematic_velocities=motion.vectors(self.kinematic_velocities),
            kinematic_rates=motion.vectors(self.kinematic_rates),
        )

    def copy(self) -> "RopesState":
        """Returns a copy with arrays of its own."""
        return replace(self, **{field.name: getattr(self, field.name).copy() for field in fields(self)})
