"""Closes a garment at its rims, so that it has an inside, like a body."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Self

import numpy as np

from hemline.arrays import Faces, Int, Vertices
from hemline.meshes import boundary_loops, vertex_normals

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody


LID_REACH = 0.03
"""Length of the strip that continues the cloth beyond a rim [m]."""
LID_INSET = 0.02
"""Distance by which this strip approaches the skin [m]; the rest of the lid is flat."""


@dataclass(frozen=True, eq=False)
class ClosedCloth:
    """A garment with a lid on each of its rims: a strip that slopes inward from the rim, then a fan to its middle.

    The lid of a waist, a sleeve or a hem passes through the body, so that only the strip lies outside of the body. What
    is inside of the closed garment and outside of the body is what lies beneath the cloth, and what cloth that lies
    over the rim cannot reach. The nearest way out leads through the cloth or over the strip, not through a hole.

    Attributes:
        rims: Vertices of each rim.
        faces: Triangles of the garment, then those of the lids.
    """

    rims: tuple[Int[np.ndarray, " rim"], ...]
    faces: Faces

    @classmethod
    def of(cls, count: int, faces: Faces) -> Self:
        """Closes a garment.

        Args:
            count: Number of its vertices.
            faces: Triangles of the garment.
        """
        rims, added = boundary_loops(faces), [faces]
        for rim in rims:
            # a rim runs against its own triangles, and so with those of the lid
            strip = np.arange(count, count + len(rim))
            after, beyond = np.roll(rim, -1), np.roll(strip, -1)
            count += len(rim) + 1
            added += [
                np.stack([rim, after, strip], axis=1),
                np.stack([after, beyond, strip], axis=1),
                np.stack([strip, beyond, np.full(len(rim), count - 1)], axis=1),
            ]
        return cls(rims, np.concatenate(added).astype(np.int32))

    def vertices(self, cloth: Vertices) -> Vertices:
        """Returns the vertices of the closed garment: those of the garment, then strip and middle of each lid [m]."""
        return np.concatenate([cloth, *(lid_vertices(cloth[rim]) for rim in self.rims)])

    def as_body(self, shaped: "ShapedBody", rest: Vertices) -> "ShapedBody":
        """Returns the closed garment as a body that takes the wearer's place, moved by the bones of the skin beneath.

        Args:
            shaped: The body that wears the garment.
            rest: The garment at rest on it [m].
        """
        from scipy.spatial import KDTree

        vertices = self.vertices(rest)
        nearest = np.asarray(KDTree(shaped.vertices).query(vertices)[1])
        body = replace(
            shaped.body,
            template=vertices,
            faces=self.faces,
            shapedirs=np.zeros((0, *vertices.shape), np.float32),
            joint_shapedirs=shaped.body.joint_shapedirs[:0],
            weight_indices=shaped.body.weight_indices[nearest],
            weights=shaped.body.weights[nearest],
            posedirs=None,
        )
        normals = vertex_normals(vertices, self.faces).astype(np.float32)
        return replace(shaped, body=body, betas=shaped.betas[:0], vertices=vertices, normals=normals)


def lid_vertices(rim: Vertices) -> Vertices:
    """Returns the vertices of a lid: its strip beyond the rim, one for each of the rim's, then its middle [m].

    Args:
        rim: Vertices of a rim in order, the hole on the left as seen from outside [m].
    """
    points = np.asarray(rim, np.float64)
    inward = points.mean(axis=0) - points
    across = np.cross(points, np.roll(points, -1, axis=0)).sum(axis=0)
    across /= max(np.linalg.norm(across), 1e-12)
    inward -= np.outer(inward @ across, across)
    far = np.linalg.norm(inward, axis=1, keepdims=True)
    strip = points + LID_REACH * across + inward * np.minimum(LID_INSET / np.maximum(far, 1e-12), 0.5)
    return np.concatenate([strip, strip.mean(axis=0, keepdims=True)]).astype(np.float32)
