"""Makes a lead-in from the rest pose to the first pose of a clip, about a second long."""

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
"""A clip that starts faster than this is assumed to start with a jump [m/s]."""


def interpolate_poses(first: Pose, second: Pose, fraction: float) -> Pose:
    """Interpolates between two poses, each joint by slerp; `fraction` 0 is the first, 1 the second."""
    if fraction <= 0:
        return first
    if fraction >= 1:
        return second
    rotations = slerp(first.rotations.astype(np.float64), second.rotations.astype(np.float64), fraction)
    start, end = first.translation.astype(np.float64), second.translation.astype(np.float64)
    return Pose(rotations, start + fraction * (end - start))


def lead_in(shaped: "ShapedBody", motion: Motion, frames: int) -> tuple[Motion, "Stance"]:
    """Makes poses that lead from the rest pose into a clip.

    The rest pose is turned about the vertical, and placed so far before the start of the clip that the root, from
    standing, accelerates evenly to the speed at which the clip starts.

    Args:
        shaped: The body.
        motion: The clip, placed.
        frames: Number of poses, at least 1.

    Returns:
        The poses, the rest pose first, and the stance of that rest pose.
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
        fraction = frame / frames
        eased = fraction * fraction * (3 - 2 * fraction)
        rotations.append(interpolate_poses(start, first, eased).rotations)
        translations.append(start.translation + 0.5 * velocity * total * fraction**2)
    poses = replace(motion, rotations=continuous(np.array(rotations)), translations=np.array(translations))
    return poses, placement


class Stance:
    """Placement of the rest pose: a turn about the vertical through its pelvis, and the target of that pelvis."""

    def __init__(self, yaw: float, pelvis: Float[np.ndarray, "3"], target: Float[np.ndarray, "3"]):
        self.turn = from_axis_angle(np.array([0.0, yaw, 0.0]))
        self.pelvis, self.target = np.asarray(pelvis, np.float64), np.asarray(target, np.float64)

    @classmethod
    def of(cls, shaped: "ShapedBody", first: Pose, offset: Float[np.ndarray, "3"]) -> "Stance":
        """Returns the stance that turns a shape's rest pose to the heading of `first`, at an offset from it [m]."""
        rotation = shaped.posed(first).transforms[0, :, :3].astype(np.float64)
        # the twist about y
        yaw = math.atan2(rotation[0, 2] - rotation[2, 0], rotation[0, 0] + rotation[2, 2])
        return cls(yaw, shaped.rest_pose.translation, first.translation + offset)

    def pose(self, rest: Pose) -> Pose:
        """Returns the rest pose, placed."""
        rotations = rest.rotations.astype(np.float64)
        rotations[0] = multiply(self.turn, rotations[0])
        return Pose(rotations, self.target)

    def points(self, points: Float[np.ndarray, "points 3"]) -> Float[np.ndarray, "points 3"]:
        """Returns points around the rest pose, placed with it [m]."""
        return (np.asarray(points, np.float64) - self.pelvis) @ to_matrix(self.turn).T + self.target
