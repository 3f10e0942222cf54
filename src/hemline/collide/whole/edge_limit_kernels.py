"""Compiled: edges that are too long are shortened in a few sweeps."""

import numpy as np

from hemline.compiled import kernel

from .limit_kernels import shorten

_index = np.uintp


@kernel
def limit_edges(edges, longest, free, rest, stretch, sweeps, moved):
    """Shortens edges that are too long both by the pattern and by the garment at rest on the body.

    One pass without a branch lists the edges that are too long by the pattern; only these are swept, to and fro.

    Reads: edges (edges, 2); longest (edges,): longest length by the pattern [m]; free (verts,): 1, or 0 for pinned
        vertices; rest (verts, 3): the garment at rest on this body [m]; stretch: longest length over that at rest;
        sweeps.
    Writes: moved (verts, 3) [m].
    """
    listed, count = np.empty(len(edges) + 1, np.int64), np.int64(0)
    for place in range(len(edges)):
        e = _index(place)
        a, b = _index(edges[e, 0]), _index(edges[e, 1])
        x, y, z = moved[b, 0] - moved[a, 0], moved[b, 1] - moved[a, 1], moved[b, 2] - moved[a, 2]
        listed[_index(count)] = place
        count += np.int64(x * x + y * y + z * z > longest[e] * longest[e])
    limits = np.empty(count, np.float32)
    for k in range(count):
        e = _index(listed[k])
        a, b = _index(edges[e, 0]), _index(edges[e, 1])
        x, y, z = rest[b, 0] - rest[a, 0], rest[b, 1] - rest[a, 1], rest[b, 2] - rest[a, 2]
        limits[k] = max(longest[e], stretch * np.sqrt(x * x + y * y + z * z))
    for sweep in range(sweeps):
        for turn in range(count):
            k = _index(turn if sweep % 2 == 0 else count - 1 - turn)
            e = _index(listed[k])
            shorten(moved, free, _index(edges[e, 0]), _index(edges[e, 1]), limits[k])
