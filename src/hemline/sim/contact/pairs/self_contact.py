"""Contact of the cloth with itself during one step.

Pairs of elements that come near are found at the start of the step (`self_search`), which also fixes their side. The
normal of a pair then follows the elements from Newton step to Newton step, but the side stays. Cloth that crosses
itself at the start has no side; it is moved in the direction that shortens the curve of the crossing. Energy and forces
of pairs are in `pair_kernels` and `load_kernels.press_terms`.
"""

import numpy as np
from jaxtyping import Float, UInt

from .pair_kernels import PairRows, near_rows, pair_geometry
from .pair_search_kernels import SEARCH_MARGIN


class SelfContact:
    """The pairs of a sheet in one step.

    Args:
        start: The cloth at the step's start [m].
        corners: Four vertices of each pair that may touch (the vertex, then the triangle; or one edge, then the other),
            and 1 for a pair of edges.
        thickness: Distance that the elements of each pair keep [m].
        stiffness: Contact stiffness of each pair [N/m].
        friction: Coulomb's coefficient of each pair.
        untangling: Pairs that pull crossings apart, or None.
        crossed: Edges that cross a triangle at the start, as vertex pairs.
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

    def pair_rows(self, positions: Float[np.ndarray, "verts 3"]) -> list[PairRows]:
        """Returns the current pairs, on their sides at the start, and the pairs that untangle the cloth."""
        corners = self.corners
        weights, normal, distance, carried = _empty(len(corners))
        pair_geometry(positions, self._start, corners, self._normal, weights, normal, distance, carried)
        self._normal, thickness = normal, self._thickness
        columns = (weights, normal, thickness, carried, thickness, self._stiffness, self._limit)
        out = PairRows(np.empty((len(distance), 4), np.uint32), *(np.empty_like(each) for each in columns))
        count = near_rows(distance, SEARCH_MARGIN, (corners, *columns), tuple(out))
        near = PairRows(*(each[:count] for each in out))
        rows = near._replace(reach=near.thickness)
        return [rows] if self.untangling is None else [rows, self.untangling]


def _empty(count: int) -> tuple[np.ndarray, ...]:
    """Returns arrays for the results of `pair_geometry`: weights, normals, distances, vectors at the start."""
    return np.empty((count, 4)), np.empty((count, 3)), np.empty(count), np.empty((count, 3))
