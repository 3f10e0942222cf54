"""Limits of the distances between bones: the cloth between them allows no more, compiled."""

import math

from hemline.compiled import kernel


@kernel
def limit_bones(parents, lengths, pairs, spans, ropes_stretch, pairs_stretch, sweeps, positions_out):
    """Brings bones together that are farther apart than the cloth allows.

    In each sweep, neighbours across the cloth share the move equally, except kinematic ones, which stay. Then each bone
    that is too far from the one above it is pulled towards that one.

    Reads: parents (nodes,), -1 for kinematic nodes; lengths (nodes,) of the ropes above [m]; pairs (pairs, 2):
        neighbours across the cloth; spans (pairs,): the longest distance that the cloth allows [m]; ropes_stretch,
        pairs_stretch: the largest ratios of distance to length or span [1]; sweeps: number of sweeps.
    Writes: positions_out (nodes, 3): changed [m].
    Returns: the largest excess of a rope or pair before the limiting, relative to its largest length [1].
    """
    worst = 0.0
    for sweep in range(sweeps):
        for k in range(pairs.shape[0]):
            a, b, most = pairs[k, 0], pairs[k, 1], pairs_stretch * spans[k]
            x, y, z = (
                positions_out[b, 0] - positions_out[a, 0],
                positions_out[b, 1] - positions_out[a, 1],
                positions_out[b, 2] - positions_out[a, 2],
            )
            span = math.sqrt(x * x + y * y + z * z)
            for_a, for_b = 1.0 if parents[a] >= 0 else 0.0, 1.0 if parents[b] >= 0 else 0.0
            if span <= most or for_a + for_b == 0.0:
                continue
            if sweep == 0:
                worst = max(worst, span / most - 1.0)
            pull = (span - most) / (span * (for_a + for_b))
            positions_out[a, 0] += for_a * pull * x
            positions_out[a, 1] += for_a * pull * y
            positions_out[a, 2] += for_a * pull * z
            positions_out[b, 0] -= for_b * pull * x
            positions_out[b, 1] -= for_b * pull * y
            positions_out[b, 2] -= for_b * pull * z
        for i in range(parents.shape[0]):
            if parents[i] < 0:
                continue
            p, most = parents[i], ropes_stretch * lengths[i]
            x, y, z = (
                positions_out[i, 0] - positions_out[p, 0],
                positions_out[i, 1] - positions_out[p, 1],
                positions_out[i, 2] - positions_out[p, 2],
            )
            span = math.sqrt(x * x + y * y + z * z)
            if span <= most:
                continue
            if sweep == 0:
                worst = max(worst, span / most - 1.0)
            ratio = most / span
            positions_out[i, 0] = positions_out[p, 0] + ratio * x
            positions_out[i, 1] = positions_out[p, 1] + ratio * y
            positions_out[i, 2] = positions_out[p, 2] + ratio * z
        if worst == 0.0:
            break
    return worst
