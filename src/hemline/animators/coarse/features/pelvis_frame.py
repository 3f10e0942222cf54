"""The coordinates in which a network is given a posed body: the pelvis is the origin, its heading is removed."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np

from hemline.arrays import Float
from hemline.motions.motion import JOINT_COUNT
from hemline.motions.quaternions import from_matrix, heading, inverse, multiply, to_axis_angle, to_matrix

if TYPE_CHECKING:
    from hemline.bodies import PosedBody, ShapedBody
    from hemline.motions.motion import Pose


@dataclass(frozen=True)
class PelvisFrame:
    """A frame at the pelvis of a body, turned about the vertical to the heading of the body."""

    turn: Float[np.ndarray, "3 3"]
    """Rotation from this frame to the world."""
    origin: Float[np.ndarray, "3"]
    """Position of the pelvis [m]."""

    @classmethod
    def of(cls, pose: "Pose") -> Self:
        """Returns the frame of a pose."""
        return cls(to_matrix(heading(pose.rotations[0].astype(np.float64))), pose.translation.astype(np.float64))

    def to_local(self, points: Float[np.ndarray, "... 3"]) -> Float[np.ndarray, "... 3"]:
        """Transforms points of the world to this frame [m], float32."""
        return ((points - self.origin) @ self.turn).astype(np.float32)

    def to_world(self, points: Float[np.ndarray, "... 3"]) -> Float[np.ndarray, "... 3"]:
        """Transforms points of this frame to the world [m], float32."""
        return (points @ self.turn.T + self.origin).astype(np.float32)

    def local_turns(self, turns: Float[np.ndarray, "verts 4"]) -> Float[np.ndarray, "verts 4"]:
        """Returns rotations in the world, wxyz, relative to this frame, float32."""
        return multiply(inverse(from_matrix(self.turn)), turns.astype(np.float64)).astype(np.float32)

    def local_transforms(self, posed: "PosedBody") -> Float[np.ndarray, "joints 3 4"]:
        """Returns the skin transforms of a body relative to this frame, float32."""
        local = self.turn.T @ posed.transforms.astype(np.float64)
        local[:, :, 3] -= self.turn.T @ self.origin
        return np.ascontiguousarray(local, np.float32)


def body_inputs(shaped: "ShapedBody", posed: "PosedBody", frame: PelvisFrame) -> Float[np.ndarray, " body"]:
    """Returns betas and axis-angles of the present pose, the root without its heading, float32."""
    rotations = posed.pose.rotations.astype(np.float64)
    rotations[0] = multiply(inverse(from_matrix(frame.turn)), rotations[0])
    return np.concatenate([shaped.betas, to_axis_angle(rotations).reshape(3 * JOINT_COUNT)]).astype(np.float32)
