"""Measures how fast this machine works now: other programs may keep its cores busy."""

import time

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
