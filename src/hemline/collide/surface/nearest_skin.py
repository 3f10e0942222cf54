"""Where the skin is next to each vertex of a garment, as one step of a frame tells the following ones."""

from typing import NamedTuple, Self

import numpy as np

from hemline.arrays import Bool, Float, Int


class NearestSkin(NamedTuple):
    """Where the skin is next to each vertex of a garment in one frame, in the garment's own order of vertices."""

    faces: Int[np.ndarray, " verts"]
    """Face of the skin, in the order of `Patches.faces`, that each vertex is kept over, or that is nearest; -1 if it is
    far away."""
    heights: Float[np.ndarray, " verts"]
    """Height over that face [m], negative behind it; without meaning where no face is known."""
    pinched: Bool[np.ndarray, " verts"]
    """Vertices that are not kept over any skin: each way out would tear them from their neighbours."""

    def part(self, low: int, high: int) -> Self:
        """Returns the contact of the vertices from `low` to before `high`."""
        return type(self)(*(each[low:high] for each in self))

    @classmethod
    def unknown(cls, count: int) -> Self:
        """Returns the contact of a garment of which nothing is known.

        Args:
            count: Number of vertices.
        """
        return cls(np.full(count, -1), np.zeros(count, np.float32), np.zeros(count, np.bool_))
