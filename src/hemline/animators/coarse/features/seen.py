"""The last poses of a body, at 30 frames a second whatever the steps were, and a frame as a network sees it."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Self

import numpy as np

from hemline.animators.teleport import RigidTransform
from hemline.arrays import Float
from hemline.motions.motion import JOINT_COUNT
from hemline.motions.quaternions import from_matrix, heading, inverse, multiply, rotate, slerp, to_axis_angle, to_matrix

if TYPE_CHECKING:
    from hemline.bodies import PosedBody, ShapedBody
    from hemline.motions.motion import Pose

POSE_COUNT = 65
"""Poses that a network is given: the present one and 64 before it."""
POSE_WIDTH = 3 * JOINT_COUNT + 3
"""Numbers of one pose: axis-angles of all joints, and the pelvis's way since the frame before [m]."""
POSE_INTERVAL = 1 / 30
"""Time between poses that the network is given [s]."""


@dataclass(frozen=True)
class PoseHistory:
    """Some moments of a body, the last one now."""

    seconds: Float[np.ndarray, " times"]
    """From now, so at most 0 [s]."""
    rotations: Float[np.ndarray, "times joints 4"]
    translations: Float[np.ndarray, "times 3"]
    """Of the pelvis [m]."""

    @classmethod
    def always(cls, pose: "Pose") -> Self:
        """A body that has always stood so: the history before the first frame."""
        return cls(np.zeros(1), pose.rotations[None].astype(np.float64), pose.translation[None].astype(np.float64))

    def followed(self, pose: "Pose", dt: float) -> Self:
        """After a time `dt` [s], in a pose; what lies farther back than the network looks is dropped."""
        seconds = np.append(self.seconds - dt, 0.0)
        kept = slice(max(0, int(np.searchsorted(seconds, -POSE_COUNT * POSE_INTERVAL, side="right")) - 1), None)
        rotations = np.concatenate([self.rotations, pose.rotations[None].astype(np.float64)])
        translations = np.concatenate([self.translations, pose.translation[None].astype(np.float64)])
        return type(self)(seconds[kept], rotations[kept], translations[kept])

    def transform(self, way: RigidTransform) -> Self:
        """Turned and moved as a whole."""
        rotations = self.rotations.copy()
        rotations[:, 0] = multiply(from_matrix(way.turn)[None], rotations[:, 0])
        return replace(self, rotations=rotations, translations=way.points(self.translations))

    def window(self) -> Float[np.ndarray, "poses 75"]:
        """The last 65 poses as the motion encoder wants them, float32: axis-angles, the pelvis's way since the pose
        before [m]; all as seen from the heading of the last one.

        Source: Li, Shi, Zhu, Kanai, "SwinGar", 2023, Sections III-C and IV (m = 64). Differs: one heading for all.
        """
        wanted = POSE_INTERVAL * np.arange(-POSE_COUNT, 1)
        later = np.clip(np.searchsorted(self.seconds, wanted), 1, max(1, len(self.seconds) - 1))
        if len(self.seconds) == 1:
            rotations = np.repeat(self.rotations, POSE_COUNT + 1, axis=0)
            translations = np.repeat(self.translations, POSE_COUNT + 1, axis=0)
        else:
            span = self.seconds[later] - self.seconds[later - 1]
            share = np.clip((wanted - self.seconds[later - 1]) / span, 0, 1)
            rotations = slerp(self.rotations[later - 1], self.rotations[later], share[:, None])
            one, other = self.translations[later - 1], self.translations[later]
            translations = one + share[:, None] * (other - one)
        back = inverse(heading(rotations[-1, 0]))
        rotations[:, 0] = multiply(back[None], rotations[:, 0])
        found = np.empty((POSE_COUNT, POSE_WIDTH), np.float32)
        found[:, : 3 * JOINT_COUNT] = to_axis_angle(rotations[1:]).reshape(POSE_COUNT, -1)
        found[:, 3 * JOINT_COUNT :] = rotate(back[None], np.diff(translations, axis=0))
        return found


@dataclass(frozen=True)
class PelvisFrame:
    """A posed body as the network sees it: the pelvis is the origin, its heading is taken out."""

    turn: Float[np.ndarray, "3 3"]
    """From that heading to the world."""
    origin: Float[np.ndarray, "3"]
    """The pelvis [m]."""

    @classmethod
    def of(cls, pose: "Pose") -> Self:
        """That of a pose."""
        return cls(to_matrix(heading(pose.rotations[0].astype(np.float64))), pose.translation.astype(np.float64))

    def into(self, points: Float[np.ndarray, "... 3"]) -> Float[np.ndarray, "... 3"]:
        """Points of the world, seen [m], float32."""
        return ((points - self.origin) @ self.turn).astype(np.float32)

    def to_world(self, points: Float[np.ndarray, "... 3"]) -> Float[np.ndarray, "... 3"]:
        """Points that are seen, in the world [m], float32."""
        return (points @ self.turn.T + self.origin).astype(np.float32)

    def local_turns(self, turns: Float[np.ndarray, "verts 4"]) -> Float[np.ndarray, "verts 4"]:
        """Turns into the world, wxyz, seen; float32."""
        return multiply(inverse(from_matrix(self.turn)), turns.astype(np.float64)).astype(np.float32)

    def transforms(self, posed: "PosedBody") -> Float[np.ndarray, "joints 3 4"]:
        """Skin transforms of a body, seen; float32."""
        found = self.turn.T @ posed.transforms.astype(np.float64)
        found[:, :, 3] -= self.turn.T @ self.origin
        return np.ascontiguousarray(found, np.float32)


def body_inputs(shaped: "ShapedBody", posed: "PosedBody", seen: PelvisFrame) -> Float[np.ndarray, " body"]:
    """Betas and axis-angles of the present pose, the root's without its heading, float32."""
    rotations = posed.pose.rotations.astype(np.float64)
    rotations[0] = multiply(inverse(from_matrix(seen.turn)), rotations[0])
    return np.concatenate([shaped.betas, to_axis_angle(rotations).reshape(3 * JOINT_COUNT)]).astype(np.float32)
