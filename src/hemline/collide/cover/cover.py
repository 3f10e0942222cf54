"""Skin that looks out between the vertices of cloth: triangles moved out over it."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np

from hemline.arrays import BodyVertices, Faces, Int, Vertices
from hemline.meshes import face_normals

from .cover_kernels import cover_points

if TYPE_CHECKING:
    from hemline.bodies.body import ShapedBody

REACH = 0.025
"""A triangle may cover vertices of the body whose distance from its middle is at most this at rest [m]."""
SLIP = 0.004
"""And which are beside it by no more than this: so far the cloth may slip along the skin [m]."""
GAP = 0.0015
"""How far behind the cloth covered vertices are [m]."""
DEEPEST = 0.02
"""A vertex that is farther in front of a triangle is not covered by it, but elsewhere [m]."""
SWEEPS = 2
FACING = 0.3
"""Least cosine between the normals of cloth and skin."""


@dataclass(frozen=True, eq=False)
class Cover:
    """Which triangles of a garment may cover which vertices of the body: those near to each other at rest.

    Attributes:
        corners: The triangles that may cover something, int32.
        starts: Where the vertices of the body of each of them begin, and their number, int32.
        points: Vertices of the body, int32.
    """

    corners: Int[np.ndarray, "covering 3"]
    starts: Int[np.ndarray, " _starts"]
    points: Int[np.ndarray, " pairs"]

    @classmethod
    def prepare(cls, shaped: "ShapedBody", vertices: Vertices, faces: Faces) -> Self:
        """Find the pairs.

        Args:
            shaped: The body on which the garment lies so.
            vertices: The garment at rest, in the rest pose of the body [m].
            faces: Its triangles.
        """
        from scipy.spatial import KDTree

        corners = vertices[faces].astype(np.float64)
        middles, normals = corners.mean(axis=1), face_normals(vertices.astype(np.float64), faces)
        near = KDTree(shaped.vertices).query_ball_point(middles, REACH)
        counts = np.array([len(each) for each in near])
        face, point = np.repeat(np.arange(len(faces)), counts), np.concatenate([np.empty(0, int), *near]).astype(int)
        away = shaped.vertices[point] - middles[face]
        beside = np.linalg.norm(away - np.einsum("pi,pi->p", away, normals[face])[:, None] * normals[face], axis=1)
        radii = np.linalg.norm(corners - middles[:, None], axis=2).max(axis=1)
        facing = np.einsum("pi,pi->p", shaped.normals[point], normals[face])
        kept = (facing > FACING) & (beside < radii[face] + SLIP)
        covering, counts = np.unique(face[kept], return_counts=True)
        starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
        points = point[kept].astype(np.int32)
        return cls(np.ascontiguousarray(faces[covering], np.int32), starts, points)

    def step(self, skin: BodyVertices, vertices: Vertices) -> Vertices:
        """The garment with its triangles over the skin that they cover.

        Args:
            skin: The body now [m].
            vertices: The garment [m]; it is not changed.
        """
        result = np.array(vertices, np.float32)
        lengths = np.float32(GAP), np.float32(DEEPEST)
        cover_points(self.starts, self.points, self.corners, skin, *lengths, SWEEPS, result)
        return result
