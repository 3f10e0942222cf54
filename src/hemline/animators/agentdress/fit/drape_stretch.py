"""How long the edges of a garment are in its drapes, which is how long they may be when it is played."""

import numpy as np

from hemline.animators.agentdress.bounds import LEAST_STRETCH_LIMIT, MOST_STRETCH_LIMIT
from hemline.arrays import Float
from hemline.datasets import Dataset
from hemline.meshes import rest_lengths

MOST_DRAPES = 64
"""Most drapes that are measured; of more, an even selection is taken."""
PERCENTILE = 99.0
"""Percentage of the edges of a drape that are within the limit."""


def stretch_limit(dataset: Dataset, rest: Float[np.ndarray, "verts 3"]) -> float:
    """Returns the longest length of an edge that is usual in the drapes on the mean body.

    Lengths are relative to the longer of those on the pattern and at rest. The limit is the mean over drapes of the
    99th percentile over edges, between `LEAST_STRETCH_LIMIT` and `MOST_STRETCH_LIMIT`.

    Args:
        dataset: A dataset made by `hemline drape`.
        rest: The garment at rest on the mean body [m].
    """
    garment = dataset.garment
    edges, lengths = rest_lengths(garment.faces, garment.rest_edges)
    longest = np.maximum(lengths, _lengths(rest, edges))
    rows = [row for row in dataset.anchors() if not np.any(row.betas)]
    some = rows[:: -(-len(rows) // MOST_DRAPES)]
    ratios = [np.percentile(_lengths(dataset.take(row).vertices[0], edges) / longest, PERCENTILE) for row in some]
    return float(np.clip(np.mean(ratios), LEAST_STRETCH_LIMIT, MOST_STRETCH_LIMIT))


def _lengths(vertices: np.ndarray, edges: np.ndarray) -> Float[np.ndarray, " edges"]:
    ends = np.asarray(vertices, np.float64)[edges]
    return np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
