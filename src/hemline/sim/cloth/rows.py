"""Sparse patterns by rows, such as the corners of each vertex or its neighbours."""

from typing import NamedTuple

import numpy as np
from jaxtyping import UInt


class Rows(NamedTuple):
    """A sparse pattern: row i holds `columns[starts[i]:starts[i + 1]]`.

    Indices are unsigned, so that compiled code need not check whether they count from the end, which takes a third of
    the time.
    """

    starts: UInt[np.ndarray, " rows_and_one"]
    columns: UInt[np.ndarray, " entries"]


def incidence(rows: np.ndarray, values: np.ndarray, count: int) -> Rows:
    """Returns the pattern that lists the values of each row, in their order."""
    order = np.argsort(rows, kind="stable")
    starts = np.concatenate([[0], np.cumsum(np.bincount(rows, minlength=count))])
    return Rows(starts.astype(np.uint32), values[order].astype(np.uint32))
