"""Where a body is put elsewhere, as in a game, and rigid motions."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from hemline.arrays import Float
from hemline.motions.motion import Pose
from hemline.motions.quaternions import angle, from_matrix, inverse, multiply

TELEPORT_DISTANCE = 1.0
"""A pelvis that goes farther in a frame is put there [m]."""
TELEPORT_SPEED = 15.0
"""So is one that is faster than this, in a longer time [m/s]."""
TELEPORT_ANGLE = np.radians(100)
"""So is one that turns farther in a frame [rad]."""


def is_teleport(first: Pose, second: Pose, seconds: float) -> bool:
    """Whether a body was put elsewhere instead of going there.

    Args:
        first: Before.
        second: After.
        seconds: Time between them.
    """
    way = float(np.linalg.norm(second.translation.astype(np.float64) - first.translation))
    one, two = (each.rotations[0].astype(np.float64) for each in (first, second))
    turned = float(angle(multiply(inverse(one), two)))
    return way > max(TELEPORT_DISTANCE, TELEPORT_SPEED * seconds) or (turned > TELEPORT_ANGLE and seconds < 0.1)


@dataclass(frozen=True)
class RigidTransform:
    """A rotation and a shift."""

    turn: Float[np.ndarray, "3 3"]
    shift: Float[np.ndarray, "3"]

    @classmethod
    def of(cls, transform: Float[np.ndarray, "3 4"]) -> Self:
        """The one of a skin transform [R | t]."""
        transform = transform.astype(np.float64)
        return cls(transform[:, :3], transform[:, 3])

    @classmethod
    def shifted(cls, shift: Float[np.ndarray, "3"]) -> Self:
        """A shift alone [m]."""
        return cls(np.eye(3), np.asarray(shift, np.float64))

    @classmethod
    def between(cls, first: Float[np.ndarray, "3 4"], second: Float[np.ndarray, "3 4"]) -> Self:
        """The one that takes what a joint carries from one of its transforms to another."""
        one, two = cls.of(first), cls.of(second)
        turn = two.turn @ one.turn.T
        return cls(turn, two.shift - turn @ one.shift)

    def points(self, points: Float[np.ndarray, "points 3"]) -> Float[np.ndarray, "points 3"]:
        """Points, moved."""
        return points @ self.turn.T + self.shift

    def back(self, points: Float[np.ndarray, "points 3"]) -> Float[np.ndarray, "points 3"]:
        """Points from where they were moved to."""
        return (points - self.shift) @ self.turn

    def after(self, first: Self) -> Self:
        """Another one, and then this one."""
        return type(self)(self.turn @ first.turn, self.turn @ first.shift + self.shift)

    def frames(self, frames: Float[np.ndarray, "... 3 4"]) -> Float[np.ndarray, "... 3 4"]:
        """Transforms, moved."""
        moved = self.turn @ frames
        moved[..., 3] += self.shift
        return moved

    def pose(self, pose: Pose) -> Pose:
        """A pose, moved."""
        rotations = pose.rotations.astype(np.float64)
        rotations[0] = multiply(from_matrix(self.turn), rotations[0])
        return Pose(rotations, self.points(pose.translation.astype(np.float64)))

    def pose_back(self, pose: Pose) -> Pose:
        """A pose from where it was moved to."""
        rotations = pose.rotations.astype(np.float64)
        rotations[0] = multiply(inverse(from_matrix(self.turn)), rotations[0])
        return Pose(rotations, self.back(pose.translation.astype(np.float64)))

    def vectors(self, vectors: Float[np.ndarray, "points 3"]) -> Float[np.ndarray, "points 3"]:
        """Vectors, turned."""
        return vectors @ self.turn.T
