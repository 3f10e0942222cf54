"""Where on the body each vertex of the cloth is nearest to it, and the planes that hold it off there."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int


class SkinPoints(NamedTuple):
    """Where on the surface each cloth vertex is nearest to.

    Attributes:
        nearest: Nearest body vertex within reach, -1 for none.
        face: Closest body face, -1 for none.
        weights: Barycentric weights of its corners 1 and 2.
    """

    nearest: Int[np.ndarray, " verts"]
    face: Int[np.ndarray, " verts"]
    weights: Float[np.ndarray, "verts 2"]


class Planes(NamedTuple):
    """Tangent planes of the body under the cloth at the end of a step.

    Attributes:
        normal: Unit normals; 0 where there is no contact.
        point: Points on the body [m].
        carried: Where the body would carry each vertex during the step [m].
        stiffness: Contact stiffness [N/m]; 0 where there is no contact.
    """

    normal: Float[np.ndarray, "verts 3"]
    point: Float[np.ndarray, "verts 3"]
    carried: Float[np.ndarray, "verts 3"]
    stiffness: Float[np.ndarray, " verts"]

    def gap(self, positions: Float[np.ndarray, "verts 3"]) -> Float[np.ndarray, " verts"]:
        """Signed distance from the planes [m], infinite where there is none."""
        distance = np.einsum("vi,vi->v", self.normal, positions - self.point)
        return np.where(self.stiffness > 0, distance, np.inf)


def no_planes(count: int) -> Planes:
    """No contact at all."""
    nothing = np.zeros((count, 3))
    return Planes(nothing, nothing, nothing, np.zeros(count))
