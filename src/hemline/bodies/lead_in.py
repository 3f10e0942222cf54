"""From the rest pose to the first pose of a clip: a run-up of about a second."""

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from hemline.motions.motion import Motion, Pose
from hemline.motions.quaternions import continuous, from_axis_angle, multiply, slerp, to_matrix

if TYPE_CHECKING:
    from . import ShapedBody

FASTEST_START = 8.0
"""A clip that starts faster than this is taken to start with a jump [m/s]."""


def between(first: Pose, second: Pose, share: float) -> Pose:
    """The pose at a share of the way between two, each joint by slerp."""
    if share <= 0:
        return first
    if share >= 1:
        return second
    rotations = slerp(first.rotations.astype(np.float64), second.rotations.astype(np.float64), share)
    start, end = first.translation.astype(np.float64), second.translation.astype(np.float64)
    return Pose(rotations, start + share * (end - start))


def lead_in(shaped: "ShapedBody", motion: Motion, frames: int) -> tuple[Motion, "Stance"]:
    """Poses before a clip, the rest pose first, and where that rest pose was put.

    The rest pose is turned about the vertical and moved to where the clip starts, less the run-up: from standing, the
    root speeds up evenly to the speed at which the clip starts.

    Args:
        shaped: The body.
        motion: The clip, placed.
        frames: How many poses; at least 1.
    """
    first, rest = motion[0], shaped.rest_pose
    velocity = np.zeros(3)
    if len(motion) > 1:
        velocity = (motion.translations[1].astype(np.float64) - motion.translations[0]) * motion.fps
        velocity[1] = 0.0
        velocity *= min(1.0, FASTEST_START / max(float(np.linalg.norm(velocity)), 1e-9))
    total = frames / motion.fps
    placement = Stance.of(shaped, first, -0.5 * total * velocity)
    start = placement.pose(rest)
    rotations, translations = [], []
    for frame in range(frames):
        share = frame / frames
        eased = share * share * (3 - 2 * share)
        rotations.append(between(start, first, eased).rotations)
        translations.append(start.translation + 0.5 * velocity * total * share**2)
    poses = replace(motion, rotations=continuous(np.array(rotations)), translations=np.array(translations))
    return poses, placement


class Stance:
    """A turn about the vertical through the pelvis of the rest pose, and where that pelvis goes."""

    def __init__(self, yaw: float, pelvis: Float[np.ndarray, "3"], target: Float[np.ndarray, "3"]):
        self.turn = from_axis_angle(np.array([0.0, yaw, 0.0]))
        self.pelvis, self.target = np.asarray(pelvis, np.float64), np.asarray(target, np.float64)

    @classmethod
    def of(cls, shaped: "ShapedBody", first: Pose, offset: Float[np.ndarray, "3"]) -> "Stance":
        """The one that heads a shape's rest pose the way that `first` heads, `offset` from it."""
        rotation = shaped.posed(first).transforms[0, :, :3].astype(np.float64)
        # the twist about y of that rotation
        yaw = math.atan2(rotation[0, 2] - rotation[2, 0], rotation[0, 0] + rotation[2, 2])
        return cls(yaw, shaped.rest_pose.translation, first.translation + offset)

    def pose(self, rest: Pose) -> Pose:
        """The rest pose, placed."""
        rotations = rest.rotations.astype(np.float64)
        rotations[0] = multiply(self.turn, rotations[0])
        return Pose(rotations, self.target)

    def points(self, points: Float[np.ndarray, "points 3"]) -> Float[np.ndarray, "points 3"]:
        """Points around the rest pose, placed with it."""
        return (np.asarray(points, np.float64) - self.pelvis) @ to_matrix(self.turn).T + self.target
