"""Where a body was dragged to: a rigid motion on top of its clip."""

from dataclasses import dataclass, field

import numpy as np

from hemline.arrays import Float
from hemline.motions import Pose
from hemline.motions.quaternions import angle, inverse, multiply, normalised, rotate, slerp

FASTEST_FOLLOW = 0.15
"""Farthest that a body follows the hand in one frame [m]."""
QUICKEST_TURN = 0.2
"""Most that it turns with it [rad]."""


def _no_turn() -> np.ndarray:
    return np.array([1.0, 0.0, 0.0, 0.0])


@dataclass(frozen=True, eq=False)
class BodyShift:
    """A rotation, then a translation, of all that a clip does: x -> turn x + way. Both in float64."""

    turn: Float[np.ndarray, "4"] = field(default_factory=_no_turn)
    """Unit quaternion, wxyz."""
    way: Float[np.ndarray, "3"] = field(default_factory=lambda: np.zeros(3))
    """In the world [m]."""

    @property
    def still(self) -> bool:
        """Whether nothing was dragged."""
        return not self.way.any() and np.array_equal(self.turn, _no_turn())

    def of(self, pose: Pose) -> Pose:
        """A pose, moved; the very same one where nothing was dragged.

        Args:
            pose: A pose that is placed on its body.
        """
        if self.still:
            return pose
        rotations = pose.rotations.astype(np.float64)
        rotations[0] = normalised(multiply(self.turn, rotations[0]))
        return Pose(rotations, rotate(self.turn, pose.translation.astype(np.float64)) + self.way)

    def dragged(self, handle: np.ndarray, to: np.ndarray, turn: np.ndarray) -> "Shift":
        """This, with a handle on the body dragged.

        Args:
            handle: Where the handle was taken (3,) [m].
            to: Where it is now (3,) [m].
            turn: How it was turned meanwhile (4,), wxyz.
        """
        return BodyShift(normalised(multiply(turn, self.turn)), rotate(turn, self.way - handle) + to)

    def towards(self, goal: "Shift", pivot: np.ndarray) -> "Shift":
        """A frame's step towards a goal, so that a jump of the hand is no jump of the body.

        Args:
            goal: Where the hand is.
            pivot: The pelvis in the clip, without any shift (3,) [m].
        """
        here, there = (rotate(each.turn, pivot) + each.way for each in (self, goal))
        turned = float(angle(multiply(inverse(self.turn), goal.turn)))
        far = float(np.linalg.norm(there - here))
        if far <= FASTEST_FOLLOW and turned <= QUICKEST_TURN:
            return goal
        share = min(FASTEST_FOLLOW / max(far, 1e-9), QUICKEST_TURN / max(turned, 1e-9), 1.0)
        turn = normalised(slerp(self.turn, goal.turn, share))
        return BodyShift(turn, here + share * (there - here) - rotate(turn, pivot))
