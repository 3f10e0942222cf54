"""A compiled network layer on many rows, in parallel blocks of rows; products do without BLAS and its threads."""

import numpy as np

from hemline.compiled import kernel, prange
from hemline.learning.product_kernels import add_product

ROW_BLOCK = 48
"""Number of rows that a thread takes at a time."""


@kernel(parallel=True)
def dense(inputs, weights, start, rectified, out):
    """Computes a layer: `out = start + inputs weights`.

    Reads: inputs (rows, n); weights (n, m); start (rows, m) or (1, m); rectified: whether negative outputs become zero.
    Writes: out (rows, m).
    """
    rows = len(inputs)
    for block in prange((rows + ROW_BLOCK - 1) // ROW_BLOCK):
        first = block * ROW_BLOCK
        last = min(rows, first + ROW_BLOCK)
        for i in range(first, last):
            at = i if len(start) > 1 else 0
            for j in range(out.shape[1]):
                out[i, j] = start[at, j]
        add_product(inputs[first:last], weights, out[first:last])
        if rectified:
            for i in range(first, last):
                for j in range(out.shape[1]):
                    out[i, j] = max(out[i, j], np.float32(0))
