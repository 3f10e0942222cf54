"""What holds parts of the cloth apart, from each other or from the body, at one moment of a step."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, UInt

from hemline.sim.cloth.sheet import Rows

from .pair_kernels import FEW, incidence_of_pairs

_NOWHERE = Rows(np.empty(0, np.uint32), np.empty(0, np.uint32))


@dataclass(frozen=True)
class PairRows:
    """Pairs of one kind.

    Attributes:
        corners: Four vertices of each, uint32.
        weights: Of the corners: r = sum w x. They add up to 0 where cloth meets cloth: r is the vector between the
            nearest points; and to 1 where a point of the cloth meets the body.
        normal: Unit normals.
        reach: Of the pair's contact: n . r is to be so much [m].
        carried: r where it would be without slip [m].
        thickness: How far below `reach` the load grows [m].
        stiffness: [N/m]
        limit: Friction that each can bear, by its load at the step's start [N].
    """

    corners: UInt[np.ndarray, "pairs 4"]
    weights: Float[np.ndarray, "pairs 4"]
    normal: Float[np.ndarray, "pairs 3"]
    reach: Float[np.ndarray, " pairs"]
    carried: Float[np.ndarray, "pairs 3"]
    thickness: Float[np.ndarray, " pairs"]
    stiffness: Float[np.ndarray, " pairs"]
    limit: Float[np.ndarray, " pairs"]

    def __len__(self) -> int:
        return len(self.corners)

    @property
    def arrays(self) -> tuple[np.ndarray, ...]:
        """All of them, in the order that kernels take them."""
        return (
            self.corners,
            self.weights,
            self.normal,
            self.reach,
            self.carried,
            self.thickness,
            self.stiffness,
            self.limit,
        )


@dataclass(frozen=True)
class Pairs:
    """All pairs of a step, and for each vertex its pairs, each 4 pair + corner; of a few pairs nobody asks that."""

    rows: PairRows
    at: Rows

    @classmethod
    def of(cls, parts: Sequence[PairRows], vertex_count: int) -> "Pairs":
        """Gather pairs of all kinds."""
        rows = (
            parts[0]
            if len(parts) == 1
            else PairRows(*(np.concatenate(each) for each in zip(*(part.arrays for part in parts), strict=True)))
        )
        if len(rows) <= FEW:
            return cls(rows, _NOWHERE)
        starts, entries = np.empty(vertex_count + 2, np.uint32), np.empty(4 * len(rows), np.uint32)
        incidence_of_pairs(rows.corners, starts, entries)
        return cls(rows, Rows(starts[:-1], entries))

    def __len__(self) -> int:
        return len(self.rows)
