"""The exact signed distance to a posed body, on which the network is trained and evaluated."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np

from hemline.arrays import Faces, Float, Points, Vertices
from hemline.collide.winding.numbers import inside
from hemline.meshes import ClosestTree, face_normals

if TYPE_CHECKING:
    from hemline.bodies import PosedBody

PROBE_HEIGHT = 0.0005
"""A triangle belongs to the outer skin if the point at this height over its middle is outside [m]."""
CONTACT_DISTANCE = 1e-6
"""The gradient at a point nearer to the skin than this is the normal of the skin [m]."""


@dataclass(frozen=True, eq=False)
class ExactDistance:
    r"""$s(x) = \mathrm{sgn}(x, M_b)\,d(x, M_b)$, negative inside, by a tree over the triangles of the body.

    Source: Li et al., "SwinGar", 2023, Eq. 7. Differs: negative inside; triangles within another part of the body are
    skipped, so that the distance is that to the visible skin.
    """

    vertices: Vertices
    """Vertices of the posed body [m]."""
    faces: Faces
    """All its triangles, which define inside and outside."""
    tree: ClosestTree
    """Search tree of the outer triangles."""

    @classmethod
    def of(cls, posed: "PosedBody") -> Self:
        """Makes the distance to a posed body."""
        vertices, faces = posed.vertices, posed.faces
        front = vertices[faces].mean(axis=1) + np.float32(PROBE_HEIGHT) * face_normals(vertices, faces)
        outer = ~inside(vertices, faces, front)
        return cls(vertices, faces, ClosestTree(vertices.astype(np.float64), np.ascontiguousarray(faces[outer])))

    def signed_distances(self, points: Points) -> Float[np.ndarray, " points"]:
        """Returns the signed distances of points [m], float64."""
        return self.with_gradients(points)[0]

    def with_gradients(self, points: Points) -> tuple[Float[np.ndarray, " points"], Float[np.ndarray, "points 3"]]:
        """Returns the signed distances of points [m] and their unit gradients, float64."""
        closest = self.tree.closest(points)
        sign = np.where(inside(self.vertices, self.faces, points), -1.0, 1.0)
        away = (points - closest.positions) * sign[:, None]
        near = closest.distances < CONTACT_DISTANCE
        gradients = away / np.maximum(closest.distances, CONTACT_DISTANCE)[:, None]
        return sign * closest.distances, np.where(near[:, None], self.tree.outward(closest), gradients)
