"""Friction anchors: points that ride on the triangles of the body's skin and hold cloth vertices."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from hemline.arrays import Faces
from hemline.sim.cloth.sheet import Positions

from .surface import MovingSkin


@dataclass(frozen=True)
class FrictionAnchors:
    """One point per cloth vertex, each fixed in the frame of a triangle of the body.

    The frame of a triangle a b c has its origin at a, its axes along b - a, across it in the plane, and along the
    normal. Static friction pulls a vertex back to its point.

    Attributes:
        face: The triangle, -1 for a vertex without one.
        local: The point in the frame of the triangle [m].
    """

    face: Int[np.ndarray, " verts"]
    local: Float[np.ndarray, "verts 3"]

    @classmethod
    def at(
        cls, positions: Positions, face: Int[np.ndarray, " verts"], skin: MovingSkin, faces: Faces
    ) -> "FrictionAnchors":
        """Returns anchors whose points are at `positions` now.

        Args:
            positions: The points [m].
            face: The triangles that the points ride on.
            skin: The skin of the body at this moment.
            faces: Triangles of the body.
        """
        origin, axes = _frames(skin, faces, face)
        return cls(face, np.einsum("vij,vi->vj", axes, positions - origin))

    def points(self, skin: MovingSkin, faces: Faces) -> Positions:
        """Returns the points on a skin [m]; they are undefined where there is no triangle."""
        origin, axes = _frames(skin, faces, self.face)
        return origin + np.einsum("vij,vj->vi", axes, self.local)

    def select(self, other: "FrictionAnchors", which: Bool[np.ndarray, " verts"]) -> "FrictionAnchors":
        """Returns these anchors where `which` is set, the other ones elsewhere."""
        return FrictionAnchors(
            np.where(which, self.face, other.face), np.where(which[:, None], self.local, other.local)
        )


def _frames(
    skin: MovingSkin, faces: Faces, face: Int[np.ndarray, " verts"]
) -> tuple[Float[np.ndarray, "verts 3"], Float[np.ndarray, "verts 3 3"]]:
    """Returns origin and axes (as columns) of triangles; -1 counts as triangle 0."""
    a, b, c = skin.vertices.astype(np.float64)[faces[np.maximum(face, 0)]].transpose(1, 0, 2)
    along = b - a
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
    normal = np.cross(along, c - a)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    return a, np.stack([along, np.cross(normal, along), normal], axis=2)
