"""Contact of the cloth with itself during one step.

A pair of elements that come near is found at the step's start (`self_search`), and its side is where it is then. From
Newton step to Newton step its normal follows the elements, but the side stays. Cloth that crosses itself at the start
has no side: what is around such a place is moved in the direction in which the curve of the crossing becomes shorter.
What pairs cost and how they push is in `pair_kernels` and `load_kernels.press_terms`.
"""

import numpy as np
from jaxtyping import Float, UInt

from .pair_kernels import PairRows, pair_geometry, near_rows

SEARCH_MARGIN = 0.001
"""Distance beyond thickness and motion up to which pairs are looked for [m]."""


class SelfContact:
    """The pairs of a sheet in one step.

    Args:
        start: The cloth at the step's start [m].
        corners: Of each pair that may meet four vertices (first the vertex, then the triangle; or one edge, then the
            other), and 1 for edges.
        thickness: Distance that the elements of each keep [m].
        stiffness: Of contact [N/m].
        friction: Coulomb's coefficient of each.
        untangling: What pulls crossings apart, or None.
        crossed: Edges that go through a triangle at the start, as vertex pairs.
    """

    def __init__(
        self,
        start: Float[np.ndarray, "verts 3"],
        corners: UInt[np.ndarray, "pairs 5"],
        *,
        thickness: Float[np.ndarray, " pairs"],
        stiffness: Float[np.ndarray, " pairs"],
        friction: Float[np.ndarray, " pairs"],
        untangling: PairRows | None,
        crossed: UInt[np.ndarray, "edges 2"],
    ):
        self.corners, self.crossed, self.untangling = corners, crossed, untangling
        self._start, self._thickness, self._stiffness = start, thickness, stiffness
        weights, self._normal, distance, carried = _empty(len(corners))
        pair_geometry(start, start, corners, np.zeros((len(corners), 3)), weights, self._normal, distance, carried)
        pressed = np.maximum(thickness - distance, 0.0)
        self._limit = friction * stiffness * pressed**2 / thickness

    def lay(self, positions: Float[np.ndarray, "verts 3"]) -> list[PairRows]:
        """The pairs where the cloth is now, on the sides that they had at the start; and what pulls crossings apart."""
        corners = self.corners
        weights, normal, distance, carried = _empty(len(corners))
        pair_geometry(positions, self._start, corners, self._normal, weights, normal, distance, carried)
        self._normal, thickness = normal, self._thickness
        found = (weights, normal, thickness, carried, thickness, self._stiffness, self._limit)
        out = PairRows(np.empty((len(distance), 4), np.uint32), *(np.empty_like(each) for each in found))
        count = near_rows(distance, SEARCH_MARGIN, (corners, *found), tuple(out))
        near = PairRows(*(each[:count] for each in out))
        rows = near._replace(reach=near.thickness)
        return [rows] if self.untangling is None else [rows, self.untangling]


def _empty(count: int) -> tuple[np.ndarray, ...]:
    """Room for what `pair_geometry` gives: weights, normals, distances, vectors at the start."""
    return np.empty((count, 4)), np.empty((count, 3)), np.empty(count), np.empty((count, 3))
