"""An open garment closed at its openings: a body of cloth, with an inside."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Self

import numpy as np

from hemline.arrays import Faces, Int, Vertices
from hemline.meshes import boundary_loops, vertex_normals

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody


LID_REACH = 0.03
"""How far the lid of a rim reaches beyond it, where it comes nearer to the skin [m]."""
LID_INSET = 0.02
"""By how much it comes nearer there [m]; from there on it is flat."""


@dataclass(frozen=True, eq=False)
class ClosedCloth:
    """A garment with a lid on each of its rims: a strip that slopes inward from the rim, then a fan to its middle.

    The lid of a waist, a sleeve or a hem goes through the body, so that what is left of it outside of the body is the
    strip. Inside of the closed garment and outside of the body is what is beneath the cloth, and what cloth that
    lies over the rim cannot reach. The nearest way out leads through the cloth or over the strip, not through a hole.

    Attributes:
        rims: Vertices of each rim.
        faces: The garment's triangles, then those of the lids.
    """

    rims: tuple[Int[np.ndarray, " rim"], ...]
    faces: Faces

    @classmethod
    def of(cls, count: int, faces: Faces) -> Self:
        """Close a garment.

        Args:
            count: Its vertices.
            faces: Its triangles.
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

    def vertices(self, worn: Vertices) -> Vertices:
        """Vertices of the closed garment: those of the garment, then strip and middle of each lid [m]."""
        return np.concatenate([worn, *(lid_vertices(worn[rim]) for rim in self.rims)])

    def as_body(self, shaped: "ShapedBody", rest: Vertices) -> "ShapedBody":
        """The closed garment in the place of the body that wears it, carried by the bones that carry the skin beneath.

        Args:
            shaped: The body.
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
    """Vertices of a lid: its strip beyond the rim, one for each of the rim's, then its middle [m].

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
