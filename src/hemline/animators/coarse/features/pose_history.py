"""The last poses of a body at 30 frames a second, whatever the time steps were."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Self

import numpy as np

from hemline.animators.rigid_transform import RigidTransform
from hemline.arrays import Float
from hemline.motions.motion import JOINT_COUNT
from hemline.motions.quaternions import from_matrix, heading, inverse, multiply, rotate, slerp, to_axis_angle

if TYPE_CHECKING:
    from hemline.motions.motion import Pose

POSE_COUNT = 65
"""Number of poses that a network is given: the present one and 64 before it."""
POSE_WIDTH = 3 * JOINT_COUNT + 3
"""Numbers of one pose: axis-angles of all joints, and the displacement of the pelvis since the pose before [m]."""
POSE_INTERVAL = 1 / 30
"""Time between the poses that a network is given [s]."""


@dataclass(frozen=True)
class PoseHistory:
    """Poses of a body at some times, the present one last."""

    seconds: Float[np.ndarray, " times"]
    """Times from now, at most 0 [s]."""
    rotations: Float[np.ndarray, "times joints 4"]
    """Rotations of the joints, wxyz."""
    translations: Float[np.ndarray, "times 3"]
    """Positions of the pelvis [m]."""

    @classmethod
    def standing(cls, pose: "Pose") -> Self:
        """Returns the history of a body that has always stood in one pose."""
        return cls(np.zeros(1), pose.rotations[None].astype(np.float64), pose.translation[None].astype(np.float64))

    def advance(self, pose: "Pose", dt: float) -> Self:
        """Adds a pose after a time `dt` [s]; drops what lies farther back than the network looks."""
        seconds = np.append(self.seconds - dt, 0.0)
        recent = slice(max(0, int(np.searchsorted(seconds, -POSE_COUNT * POSE_INTERVAL, side="right")) - 1), None)
        rotations = np.concatenate([self.rotations, pose.rotations[None].astype(np.float64)])
        translations = np.concatenate([self.translations, pose.translation[None].astype(np.float64)])
        return type(self)(seconds[recent], rotations[recent], translations[recent])

    def transform(self, transform: RigidTransform) -> Self:
        """Returns the history turned and shifted as a whole."""
        rotations = self.rotations.copy()
        rotations[:, 0] = multiply(from_matrix(transform.turn)[None], rotations[:, 0])
        return replace(self, rotations=rotations, translations=transform.points(self.translations))

    def window(self) -> Float[np.ndarray, "poses 75"]:
        """Returns the last 65 poses as the motion encoder expects them, float32.

        Each row holds axis-angles and the displacement of the pelvis since the pose before [m], relative to the heading
        of the last pose.

        Source: Li, Shi, Zhu, Kanai, "SwinGar", 2023, Sections III-C and IV (m = 64). Differs: one heading for all.
        """
        wanted = POSE_INTERVAL * np.arange(-POSE_COUNT, 1)
        later = np.clip(np.searchsorted(self.seconds, wanted), 1, max(1, len(self.seconds) - 1))
        if len(self.seconds) == 1:
            rotations = np.repeat(self.rotations, POSE_COUNT + 1, axis=0)
            translations = np.repeat(self.translations, POSE_COUNT + 1, axis=0)
        else:
            span = self.seconds[later] - self.seconds[later - 1]
            ratio = np.clip((wanted - self.seconds[later - 1]) / span, 0, 1)
            rotations = slerp(self.rotations[later - 1], self.rotations[later], ratio[:, None])
            one, other = self.translations[later - 1], self.translations[later]
            translations = one + ratio[:, None] * (other - one)
        back = inverse(heading(rotations[-1, 0]))
        rotations[:, 0] = multiply(back[None], rotations[:, 0])
        window = np.empty((POSE_COUNT, POSE_WIDTH), np.float32)
        window[:, : 3 * JOINT_COUNT] = to_axis_angle(rotations[1:]).reshape(POSE_COUNT, -1)
        window[:, 3 * JOINT_COUNT :] = rotate(back[None], np.diff(translations, axis=0))
        return window
