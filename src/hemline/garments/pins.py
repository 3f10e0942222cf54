"""Pins: vertices of a garment that follow the body."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Faces, Float, Int, Joints, Normals, Points, Vertices
from hemline.meshes import ClosestTree

if TYPE_CHECKING:
    from hemline.bodies import PosedBody

_ROUNDS = 24
_LEAST_HEIGHT = 0.001


@dataclass(frozen=True, eq=False)
class Pins:
    """Garment vertices bound to the body.

    Each pin is bound to a barycentric point of the body's surface, at a height above the skin, or rigidly to a joint.
    Hard pins fix the vertex there; soft ones pull it there with a spring.
    """

    vertices: Int[np.ndarray, " pins"]
    """Garment vertex ids, int32."""
    body_faces: Int[np.ndarray, " pins"]
    """Body triangles, int32; 0 for a pin on a joint."""
    barycentric: Float[np.ndarray, "pins 3"]
    """Weights of the triangle's corners, float32."""
    heights: Float[np.ndarray, " pins"]
    """Height above the skin along its interpolated normal, float32 [m]."""
    joints: Int[np.ndarray, " pins"] = None  # type: ignore[assignment]  # all on the surface, set below
    """Joint that carries the pin, int32; -1 for a pin on the surface."""
    offsets: Float[np.ndarray, "pins 3"] = None  # type: ignore[assignment]  # none, set below
    """Offset from that joint, along the axes of the body's rest pose, float32 [m]; 0 for a pin on the surface."""
    stiffness: Float[np.ndarray, " pins"] = None  # type: ignore[assignment]  # all hard, set below
    """Stiffness of the spring that pulls the vertex there, float32 [N/m]; infinite for a hard pin."""

    def __post_init__(self) -> None:
        count = len(self.vertices)
        for name, value in (
            ("joints", np.full(count, -1, np.int32)),
            ("offsets", np.zeros((count, 3), np.float32)),
            ("stiffness", np.full(count, np.inf, np.float32)),
        ):
            if getattr(self, name) is None:
                object.__setattr__(self, name, value)

    def __len__(self) -> int:
        return len(self.vertices)

    @classmethod
    def bind(cls, vertices: Int[np.ndarray, " pins"], positions: Points, tree: ClosestTree, normals: Normals) -> "Pins":
        """Binds garment vertices to the skin where they are.

        Solves x = q + h n, with q on the surface and n the interpolated normal there, by a damped fixed-point iteration
        on q; the best of 24 rounds is taken. Heights below 1 mm are raised to it.

        Args:
            vertices: Garment vertex ids.
            positions: Where those vertices are [m].
            tree: The body's surface at rest.
            normals: Its vertex normals.
        """
        positions = np.asarray(positions, np.float64)
        count = len(positions)
        faces, weights, heights = np.zeros(count, np.int32), np.zeros((count, 3)), np.zeros(count)
        errors, offset = np.full(count, np.inf), np.zeros((count, 3))
        for turn in range(_ROUNDS):
            closest = tree.closest(positions - offset)
            normal = np.einsum("pc,pcx->px", closest.weights, normals[tree.faces[closest.faces]].astype(np.float64))
            normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
            height = np.maximum(((positions - closest.positions) * normal).sum(axis=1), _LEAST_HEIGHT)
            above_skin = height[:, None] * normal
            error = np.linalg.norm(closest.positions + above_skin - positions, axis=1)
            nearer = error < errors
            faces[nearer], weights[nearer] = closest.faces[nearer], closest.weights[nearer]
            heights[nearer], errors[nearer] = height[nearer], error[nearer]
            # half a step: from far away, full steps would jump back and forth over bumps of the skin
            offset = above_skin if turn == 0 else (offset + above_skin) / 2
        # rounded, so that pins are the same on machines whose last bits differ
        rounded = weights.round(6).astype(np.float32), heights.round(7).astype(np.float32)
        return cls(np.asarray(vertices, np.int32), faces, *rounded)

    @classmethod
    def on_joint(cls, vertices: Int[np.ndarray, " pins"], positions: Points, joint: int, joints: Joints) -> "Pins":
        """Binds garment vertices rigidly to a joint where they are.

        Args:
            vertices: Garment vertex ids.
            positions: Where those vertices are [m].
            joint: Number of the joint.
            joints: The body's joints at rest [m].
        """
        count = len(vertices)
        weights = np.tile(np.array([1, 0, 0], np.float32), (count, 1))
        offsets = (np.asarray(positions, np.float64) - joints[joint]).round(7).astype(np.float32)
        return cls(
            np.asarray(vertices, np.int32),
            np.zeros(count, np.int32),
            weights,
            np.zeros(count, np.float32),
            joints=np.full(count, joint, np.int32),
            offsets=offsets,
        )

    @classmethod
    def concatenate(cls, parts: Sequence["Pins"]) -> "Pins":
        """Returns all pins of several sets, in their order; at least one set."""
        return cls(*(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(cls)))

    def with_stiffness(self, stiffness: float) -> "Pins":
        """Returns these pins as springs of the given stiffness per vertex [N/m]."""
        return replace(self, stiffness=np.full(len(self), stiffness, np.float32))

    def on(self, posed: "PosedBody") -> Points:
        """Returns the positions of the pins on a posed body [m], in the order of `vertices`."""
        return self.positions(posed.vertices, posed.normals, posed.faces, posed.joints, posed.transforms[:, :, :3])

    def positions(
        self,
        body_vertices: Vertices,
        body_normals: Normals,
        body_faces: Faces,
        joints: Joints,
        rotations: Float[np.ndarray, "joints 3 3"] | None = None,
    ) -> Points:
        """Returns the positions of the pins on a body.

        On the surface, x = sum_c w_c v_c + h n, with n the interpolated unit normal; on a joint, x = x_j + R_j offset.

        Args:
            body_vertices: Posed vertices [m].
            body_normals: Their unit normals.
            body_faces: The body's triangles.
            joints: Posed joints [m].
            rotations: Rotations of the joints relative to the rest pose; None: the body is at rest.

        Returns:
            Positions of the pinned garment vertices [m], in the order of `vertices`.
        """
        corner = body_faces[self.body_faces]
        weight = self.barycentric[:, :, None]
        normal = (body_normals[corner] * weight).sum(axis=1)
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
        result = (body_vertices[corner] * weight).sum(axis=1) + self.heights[:, None] * normal
        on_joint = self.joints >= 0
        if on_joint.any():
            joint, offset = self.joints[on_joint], self.offsets[on_joint]
            turned = offset if rotations is None else np.einsum("pij,pj->pi", rotations[joint], offset)
            result[on_joint] = joints[joint] + turned
        return result
