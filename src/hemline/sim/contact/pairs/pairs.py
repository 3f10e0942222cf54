"""All pairs that hold parts of the cloth off from each other or from the body, at one moment of a step."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hemline.sim.cloth.rows import Rows
from hemline.sim.solver.conjugate_kernels import FEW_PAIRS

from .pair_kernels import PairRows, incidence_of_pairs

_NO_ROWS = Rows(np.empty(0, np.uint32), np.empty(0, np.uint32))


@dataclass(frozen=True)
class Pairs:
    """All pairs of a step, and the pairs of each vertex, 4 pair + corner; the latter are left out if there are few
    pairs.
    """

    rows: PairRows
    at: Rows

    @classmethod
    def of(cls, parts: Sequence[PairRows], vertex_count: int) -> "Pairs":
        """Joins pairs of all kinds."""
        rows = parts[0] if len(parts) == 1 else PairRows(*(np.concatenate(each) for each in zip(*parts, strict=True)))
        if rows.size <= FEW_PAIRS:
            return cls(rows, _NO_ROWS)
        starts, entries = np.empty(vertex_count + 2, np.uint32), np.empty(4 * rows.size, np.uint32)
        incidence_of_pairs(rows.corners, starts, entries)
        return cls(rows, Rows(starts[:-1], entries))

    def __len__(self) -> int:
        return self.rows.size
