"""Rigid transforms of points, vectors, frames and poses."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from hemline.arrays import Float
from hemline.motions.motion import Pose
from hemline.motions.quaternions import from_matrix, inverse, multiply


@dataclass(frozen=True)
class RigidTransform:
    """A rotation, then a shift.

    Attributes:
        turn: Rotation matrix, float64.
        shift: Translation [m], float64.
    """

    turn: Float[np.ndarray, "3 3"]
    shift: Float[np.ndarray, "3"]

    @classmethod
    def of(cls, transform: Float[np.ndarray, "3 4"]) -> Self:
        """Returns the transform of a skin transform [R | t]."""
        transform = transform.astype(np.float64)
        return cls(transform[:, :3], transform[:, 3])

    @classmethod
    def translation(cls, shift: Float[np.ndarray, "3"]) -> Self:
        """Returns a transform that shifts [m] and does not rotate."""
        return cls(np.eye(3), np.asarray(shift, np.float64))

    @classmethod
    def between(cls, first: Float[np.ndarray, "3 4"], second: Float[np.ndarray, "3 4"]) -> Self:
        """Returns the motion of what a joint carries while its skin transform changes from the first to the second."""
        one, two = cls.of(first), cls.of(second)
        turn = two.turn @ one.turn.T
        return cls(turn, two.shift - turn @ one.shift)

    def points(self, points: Float[np.ndarray, "points 3"]) -> Float[np.ndarray, "points 3"]:
        """Transforms points [m]."""
        return points @ self.turn.T + self.shift

    def back(self, points: Float[np.ndarray, "points 3"]) -> Float[np.ndarray, "points 3"]:
        """Transforms points by the inverse [m]."""
        return (points - self.shift) @ self.turn

    def after(self, first: Self) -> Self:
        """Returns the composition: the other transform first, then this one."""
        return type(self)(self.turn @ first.turn, self.turn @ first.shift + self.shift)

    def frames(self, frames: Float[np.ndarray, "... 3 4"]) -> Float[np.ndarray, "... 3 4"]:
        """Transforms frames [R | t]."""
        moved = self.turn @ frames
        moved[..., 3] += self.shift
        return moved

    def pose(self, pose: Pose) -> Pose:
        """Transforms a pose: the rotation of its root and its translation."""
        rotations = pose.rotations.astype(np.float64)
        rotations[0] = multiply(from_matrix(self.turn), rotations[0])
        return Pose(rotations, self.points(pose.translation.astype(np.float64)))

    def pose_back(self, pose: Pose) -> Pose:
        """Transforms a pose by the inverse."""
        rotations = pose.rotations.astype(np.float64)
        rotations[0] = multiply(inverse(from_matrix(self.turn)), rotations[0])
        return Pose(rotations, self.back(pose.translation.astype(np.float64)))

    def vectors(self, vectors: Float[np.ndarray, "points 3"]) -> Float[np.ndarray, "points 3"]:
        """Rotates vectors."""
        return vectors @ self.turn.T
