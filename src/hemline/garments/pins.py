"""Vertices of a garment that follow the body's surface."""

from dataclasses import dataclass

import numpy as np

from hemline.arrays import Faces, Float, Int, Normals, Points, Vertices
from hemline.meshes import ClosestTree

_ROUNDS = 24
_LOWEST = 0.001


@dataclass(frozen=True, eq=False)
class Pins:
    """Garment vertices bound to barycentric points of the body's surface, each at its height above the skin."""

    vertices: Int[np.ndarray, " pins"]
    """Garment vertex ids, int32."""
    body_faces: Int[np.ndarray, " pins"]
    """Body triangles, int32."""
    barycentric: Float[np.ndarray, "pins 3"]
    """Weights of the triangle's corners, float32."""
    heights: Float[np.ndarray, " pins"]
    """Height above the skin along its interpolated normal, float32 [m]."""

    def __len__(self) -> int:
        return len(self.vertices)

    @classmethod
    def bound(
        cls, vertices: Int[np.ndarray, " pins"], positions: Points, tree: ClosestTree, normals: Normals
    ) -> "Pins":
        """Bind garment vertices to the body so that `positions` on it gives back where they are.

        Where x = q + h n with q on the surface and n the interpolated normal there: a damped fixed point on q, the
        best of 24 rounds.
        A height below 1 mm is raised to it.

        Args:
            vertices: Garment vertex ids.
            positions: Where those vertices are [m].
            tree: The body's surface at rest.
            normals: Its vertex normals.
        """
        positions = np.asarray(positions, np.float64)
        count = len(positions)
        faces, weights, heights = np.zeros(count, np.int32), np.zeros((count, 3)), np.zeros(count)
        missed, offset = np.full(count, np.inf), np.zeros((count, 3))
        for turn in range(_ROUNDS):
            closest = tree.closest(positions - offset)
            normal = np.einsum("pc,pcx->px", closest.weights, normals[tree.faces[closest.faces]].astype(np.float64))
            normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
            height = np.maximum(((positions - closest.positions) * normal).sum(axis=1), _LOWEST)
            there = height[:, None] * normal
            miss = np.linalg.norm(closest.positions + there - positions, axis=1)
            nearer = miss < missed
            faces[nearer], weights[nearer] = closest.faces[nearer], closest.weights[nearer]
            heights[nearer], missed[nearer] = height[nearer], miss[nearer]
            # half the way: from far off, full steps would jump to and fro over the skin's bumps
            offset = there if turn == 0 else (offset + there) / 2
        # rounded, so that another machine's last bits give the same pins
        rounded = weights.round(6).astype(np.float32), heights.round(7).astype(np.float32)
        return cls(np.asarray(vertices, np.int32), faces, *rounded)

    def positions(self, body_vertices: Vertices, body_normals: Normals, body_faces: Faces) -> Points:
        """Where the pins are on a body: x = sum_c w_c v_c + h n, with n the interpolated unit normal.

        Args:
            body_vertices: Posed vertices [m].
            body_normals: Their unit normals.
            body_faces: The body's triangles.

        Returns:
            Positions of the pinned garment vertices [m], in the order of `vertices`.
        """
        corner = body_faces[self.body_faces]
        weight = self.barycentric[:, :, None]
        normal = (body_normals[corner] * weight).sum(axis=1)
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
        return (body_vertices[corner] * weight).sum(axis=1) + self.heights[:, None] * normal
