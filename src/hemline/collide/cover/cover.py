"""Moves triangles of cloth out over skin that would show between their vertices."""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Self

import numpy as np

from hemline.arrays import BodyVertices, Faces, Int, Vertices
from hemline.meshes import ClosestTree, face_normals

from .cover_kernels import CoveredPoints, CoveredSkin, CoverLengths, cover_points, list_covered

if TYPE_CHECKING:
    from hemline.bodies.body import ShapedBody

COVER_DISTANCE = 0.02
"""Largest distance at rest from covered skin to the cloth over it [m]."""
COVER_GAP = 0.001
"""Distance of covered vertices behind the cloth [m]."""
COVER_DEPTH = 0.012
"""A vertex farther in front of a triangle is not covered by it [m]."""
COVER_STEPS = 8
"""Triangles of a walk from the one over a vertex at rest; it bounds how far cloth may slip along the skin."""
COVER_SWEEPS = 2
"""Passes over the covered vertices in a frame."""
COVER_COSINE = 0.3
"""Least cosine between the normals of cloth and skin."""
COVER_MARGIN = np.float32(0.005)
"""A vertex farther behind the cloth is not looked at again in the same frame, while the cloth is moved a little [m]."""
LENGTHS = CoverLengths(np.float32(COVER_GAP), np.float32(COVER_DEPTH), COVER_STEPS)
"""These lengths as kernels read them."""


@dataclass(frozen=True, eq=False)
class Cover:
    """The vertices of a body that a garment covers closely at rest, and how to find the triangle over each in a frame.

    Attributes:
        points: Vertices of the body, int32.
        over: The triangle over each of them at rest, int32.
        corners: Triangles of the garment, int32.
        beyond: The triangle across the edge opposite each corner, -1 on a rim, int32.
    """

    points: Int[np.ndarray, " points"]
    over: Int[np.ndarray, " points"]
    corners: Int[np.ndarray, "faces 3"]
    beyond: Int[np.ndarray, "faces 3"]

    @classmethod
    def prepare(cls, shaped: "ShapedBody", vertices: Vertices, faces: Faces) -> Self:
        """Finds the vertices of a body that a garment covers.

        Args:
            shaped: The body on which the garment lies.
            vertices: The garment at rest, in the rest pose of the body [m].
            faces: Triangles of the garment.
        """
        rest = np.asarray(vertices, np.float64)
        closest = ClosestTree(rest, faces).closest(shaped.vertices)
        facing = np.einsum("pi,pi->p", face_normals(rest, faces)[closest.faces], shaped.normals) > COVER_COSINE
        points = np.flatnonzero(facing & (closest.distances < COVER_DISTANCE))
        points = points[np.argsort(closest.faces[points], kind="stable")]
        over = closest.faces[points].astype(np.int32)
        return cls(points.astype(np.int32), over, np.ascontiguousarray(faces, np.int32), faces_across_edges(faces))

    @cached_property
    def covered(self) -> CoveredSkin:
        """The arrays as the kernel reads them."""
        return CoveredSkin(self.points, self.over, self.corners, self.beyond)

    def step(self, skin: BodyVertices, vertices: Vertices) -> Vertices:
        """Returns the garment with its triangles over the skin that they cover [m].

        Args:
            skin: Vertices of the body in this frame [m].
            vertices: The garment in this frame [m]; it is not changed.
        """
        result, idle = np.array(vertices, np.float32), np.zeros(len(vertices), np.bool_)
        looked_at = CoveredPoints(np.empty(len(self.points), np.int32), np.empty(len(self.points) + 1, np.int32))
        count = list_covered(self.covered, skin, LENGTHS, COVER_MARGIN, result, looked_at)
        for _ in range(COVER_SWEEPS):
            if cover_points(self.covered, skin, idle, LENGTHS, looked_at, count, result) == 0:
                break
        return result


def faces_across_edges(faces: Faces) -> Int[np.ndarray, "faces 3"]:
    """Returns the triangle across the edge opposite each corner, -1 where there is none; int32.

    Args:
        faces: Triangles; each directed edge belongs to one at most.
    """
    rows = np.asarray(faces, np.int64)
    starts, ends = np.roll(rows, -1, axis=1).ravel(), np.roll(rows, -2, axis=1).ravel()
    count = int(rows.max(initial=0)) + 1
    names, wanted = starts * count + ends, ends * count + starts
    order = np.argsort(names)
    place = np.minimum(np.searchsorted(names, wanted, sorter=order), len(names) - 1)
    met = order[place] if len(names) else place
    return np.where(names[met] == wanted, met // 3, -1).astype(np.int32).reshape(rows.shape)
