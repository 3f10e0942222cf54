"""The rigid motion that a user adds to a clip by dragging the body."""

from dataclasses import dataclass, field

import numpy as np

from hemline.arrays import Float
from hemline.motions import Pose
from hemline.motions.quaternions import angle, inverse, multiply, normalise, rotate, slerp

FASTEST_FOLLOW = 0.15
"""Longest distance that the body moves towards the pointer in one frame [m]."""
QUICKEST_TURN = 0.2
"""Largest angle by which the body turns in one frame [rad]."""


def _no_turn() -> np.ndarray:
    return np.array([1.0, 0.0, 0.0, 0.0])


@dataclass(frozen=True, eq=False)
class BodyShift:
    """A rotation, then a translation, of everything that a clip does: x -> rotation x + translation, in float64."""

    rotation: Float[np.ndarray, "4"] = field(default_factory=_no_turn)
    """Unit quaternion, wxyz."""
    translation: Float[np.ndarray, "3"] = field(default_factory=lambda: np.zeros(3))
    """Translation in the world [m]."""

    @property
    def is_identity(self) -> bool:
        """Whether nothing was dragged."""
        return not self.translation.any() and np.array_equal(self.rotation, _no_turn())

    def apply_to(self, pose: Pose) -> Pose:
        """Moves a pose; returns the very same object where nothing was dragged.

        Args:
            pose: A pose that is placed on its body.
        """
        if self.is_identity:
            return pose
        rotations = pose.rotations.astype(np.float64)
        rotations[0] = normalise(multiply(self.rotation, rotations[0]))
        return Pose(rotations, rotate(self.rotation, pose.translation.astype(np.float64)) + self.translation)

    def drag_handle(self, handle: np.ndarray, to: np.ndarray, turn: np.ndarray) -> "BodyShift":
        """Returns this shift followed by the drag of a handle on the body.

        Args:
            handle: Position at which the handle was grabbed (3,) [m].
            to: Present position of the handle (3,) [m].
            turn: Rotation of the handle since then (4,), wxyz.
        """
        return BodyShift(normalise(multiply(turn, self.rotation)), rotate(turn, self.translation - handle) + to)

    def step_towards(self, goal: "BodyShift", pivot: np.ndarray) -> "BodyShift":
        """Moves one frame towards a goal, so that a jump of the pointer is no jump of the body.

        Args:
            goal: The shift that the pointer asks for.
            pivot: Position of the pelvis in the clip, without any shift (3,) [m].
        """
        here, there = (rotate(each.rotation, pivot) + each.translation for each in (self, goal))
        turned = float(angle(multiply(inverse(self.rotation), goal.rotation)))
        distance = float(np.linalg.norm(there - here))
        if distance <= FASTEST_FOLLOW and turned <= QUICKEST_TURN:
            return goal
        fraction = min(FASTEST_FOLLOW / max(distance, 1e-9), QUICKEST_TURN / max(turned, 1e-9), 1.0)
        turn = normalise(slerp(self.rotation, goal.rotation, fraction))
        return BodyShift(turn, here + fraction * (there - here) - rotate(turn, pivot))
