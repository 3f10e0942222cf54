"""Closest points of cloth vertices on the skin, and the contact planes at these points."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int


class SkinPoints(NamedTuple):
    """The closest point on the skin for each cloth vertex.

    Attributes:
        nearest: Nearest body vertex within reach, -1 for none.
        face: Closest body face, -1 for none.
        weights: Barycentric weights of the corners 1 and 2 of that face.
    """

    nearest: Int[np.ndarray, " verts"]
    face: Int[np.ndarray, " verts"]
    weights: Float[np.ndarray, "verts 2"]


class Planes(NamedTuple):
    """Tangent planes of the body under the cloth at the end of a step.

    Attributes:
        normal: Unit normals; 0 without contact.
        point: Points on the body [m].
        carried: Positions to which the body would carry the vertices during the step [m].
        stiffness: Contact stiffness [N/m]; 0 without contact.
    """

    normal: Float[np.ndarray, "verts 3"]
    point: Float[np.ndarray, "verts 3"]
    carried: Float[np.ndarray, "verts 3"]
    stiffness: Float[np.ndarray, " verts"]

    def gap(self, positions: Float[np.ndarray, "verts 3"]) -> Float[np.ndarray, " verts"]:
        """Returns the signed distance from the planes [m], infinite without contact."""
        distance = np.einsum("vi,vi->v", self.normal, positions - self.point)
        return np.where(self.stiffness > 0, distance, np.inf)


def no_planes(count: int) -> Planes:
    """Returns planes for vertices without any contact."""
    nothing = np.zeros((count, 3))
    return Planes(nothing, nothing, nothing, np.zeros(count))
