"""Sparse patterns by rows: which corners a vertex has, which vertices are joined to it."""

from typing import NamedTuple

import numpy as np
from jaxtyping import UInt


class Rows(NamedTuple):
    """A sparse pattern: row i holds `columns[starts[i]:starts[i + 1]]`.

    Unsigned, so that compiled code need not ask whether an index counts from the end: a third of the time.
    """

    starts: UInt[np.ndarray, " rows_and_one"]
    columns: UInt[np.ndarray, " entries"]


def incidence(rows: np.ndarray, values: np.ndarray, count: int) -> Rows:
    """Pattern that lists the values of each row, in their order."""
    order = np.argsort(rows, kind="stable")
    starts = np.concatenate([[0], np.cumsum(np.bincount(rows, minlength=count))])
    return Rows(starts.astype(np.uint32), values[order].astype(np.uint32))
