"""Measures how fast this machine works now: other programs may keep its cores busy."""

import time
from types import TracebackType
from typing import Self

import numpy as np

PRODUCTS, SIZE = 40_000, 64
"""Number of matrix products that are timed, and size of the matrices. BLAS multiplies such small ones in one thread."""
REFERENCE_S = 0.25
"""Time of these products on the idle machine on which the costs of `plan` were measured [s]."""


def measure_slowness() -> float:
    """Returns the time of a piece of work now, over its time on the machine on which the costs were measured."""
    matrix = np.eye(SIZE, dtype=np.float32)
    product = matrix
    start = time.monotonic()
    for _ in range(PRODUCTS):
        product = product @ matrix
    return (time.monotonic() - start) / REFERENCE_S


class ProcessorShare:
    """Measures which share of a core a block of code had, while other programs wanted it too.

    Attributes:
        share: Processor time over elapsed time, at most 1; known when the block has ended.

    Example:
        >>> with ProcessorShare() as measured:
        ...     total = sum(range(100_000))
        >>> 0 < measured.share <= 1
        True
    """

    def __init__(self) -> None:
        self.share = 1.0

    def __enter__(self) -> Self:
        self._began = time.perf_counter(), time.process_time()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        elapsed, worked = time.perf_counter() - self._began[0], time.process_time() - self._began[1]
        self.share = min(1.0, worked / max(elapsed, 1e-9))
