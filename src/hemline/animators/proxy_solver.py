"""The interface of what moves the vertices of a simulated proxy."""

from typing import Protocol, TypeVar

from hemline.bodies import PosedBody
from hemline.motions.motion import Pose
from hemline.sim.cloth.sheet import Positions

from .rigid_transform import RigidTransform

FRAME_SECONDS = 1 / 30
"""Length of a frame; a longer time is cut into frames of this length at most [s]."""


class ProxyCloth(Protocol):
    """A proxy at the end of a frame; never changed in place."""

    @property
    def positions(self) -> Positions:
        """Positions (verts, 3) [m]."""
        ...

    @property
    def velocities(self) -> Positions:
        """Velocities (verts, 3) [m/s]."""
        ...


Cloth = TypeVar("Cloth", bound=ProxyCloth)
"""The cloth of a solver."""


class ProxySolver(Protocol[Cloth]):
    """Advances a proxy on one shape of the body from frame to frame."""

    def start(self, positions: Positions) -> Cloth:
        """Returns the cloth at rest.

        Args:
            positions: Where it is (verts, 3) [m].
        """
        ...

    def advance(self, cloth: Cloth, first: Pose, second: Pose, seconds: float) -> Cloth:
        """Returns the cloth after a frame.

        Args:
            cloth: The cloth at the first pose.
            first: Pose of the body at the start of the frame.
            second: Pose at its end.
            seconds: Length of the frame [s].

        Raises:
            SimulationFailed: No usable result was found.
        """
        ...

    def place(
        self, cloth: Cloth, positions: Positions, velocities: Positions, posed: PosedBody, seconds: float
    ) -> Cloth:
        """Returns cloth that was carried to other places instead of being simulated.

        Args:
            cloth: The cloth at the start of the frame.
            positions: Where it was carried (verts, 3) [m]. Hard pins go to their targets.
            velocities: Velocities there (verts, 3) [m/s].
            posed: The body at the end of the frame.
            seconds: Length of the frame [s].
        """
        ...

    def move(self, cloth: Cloth, transform: RigidTransform) -> Cloth:
        """Returns the cloth with its velocities, moved rigidly."""
        ...

    def stop(self, cloth: Cloth) -> Cloth:
        """Returns the cloth without its velocities."""
        ...
