"""Pinched vertices go along with the cloth around them: compiled code."""

import numpy as np

from hemline.compiled import kernel

SWEEPS = 16
"""So often are all pinched vertices gone through; cloth is pinched in folds of fewer vertices than that."""


@kernel
def carry_along(pinched, starts, neighbours, offsets_out):
    """Move each pinched vertex as the mean of its neighbours moves.

    in: pinched (k,): which, each with a neighbour; starts (n+1,), neighbours: along edges, of all vertices, one after
    the other; in and out: offsets (n,3) of all vertices, those of the pinched are found anew.
    """
    for k in range(len(pinched)):
        offsets_out[pinched[k]] = 0
    for _ in range(SWEEPS):
        for k in range(len(pinched)):
            i = pinched[k]
            x, y, z = np.float32(0), np.float32(0), np.float32(0)
            for at in range(starts[i], starts[i + 1]):
                j = neighbours[at]
                x, y, z = x + offsets_out[j, 0], y + offsets_out[j, 1], z + offsets_out[j, 2]
            share = np.float32(1) / np.float32(starts[i + 1] - starts[i])
            offsets_out[i, 0], offsets_out[i, 1], offsets_out[i, 2] = share * x, share * y, share * z
