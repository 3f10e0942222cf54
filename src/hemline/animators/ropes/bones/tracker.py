"""Filter that takes the tremor of motion capture out of moving points, without a lag at constant velocity."""

import math
from dataclasses import dataclass

from hemline.animators.rigid_transform import RigidTransform
from hemline.arrays import Nodes

TRACKING_SECONDS = 0.048
"""Time constant with which points are followed [s]."""


@dataclass(frozen=True, eq=False)
class TrackedPoints:
    r"""Points that follow given ones as a critically damped filter of their position and velocity.

    $$r = z - (x + h v), \quad x \leftarrow x + h v + (1 - \theta^2)\,r, \quad v \leftarrow v + (1 - \theta)^2\,r / h,
    \quad \theta = e^{-h / \tau}$$

    Source: Brookner, "Tracking and Kalman Filtering Made Easy", 1998 (critically damped g-h filter).
    """

    positions: Nodes
    """$x$ in the world [m]."""
    velocities: Nodes
    """$v$ [m/s]."""

    def follow(self, given: Nodes, dt: float) -> "TrackedPoints":
        """Returns the points after a time.

        Args:
            given: $z$: where they should be then [m].
            dt: $h$ [s].
        """
        theta = math.exp(-dt / TRACKING_SECONDS)
        ahead = self.positions + dt * self.velocities
        missing = given - ahead
        return TrackedPoints(ahead + (1 - theta**2) * missing, self.velocities + ((1 - theta) ** 2 / dt) * missing)

    def relocate(self, motion: RigidTransform) -> "TrackedPoints":
        """Returns the points rotated and translated as a whole, with their velocities."""
        return TrackedPoints(motion.points(self.positions), motion.vectors(self.velocities))
