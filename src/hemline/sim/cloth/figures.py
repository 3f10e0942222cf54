"""Quality figures of a take."""

from collections.abc import Sequence

import numpy as np

from hemline.arrays import FramesOfVertices, Mask
from hemline.meshes import crossing_edges, strains

from .sheet import Sheet


def strain_figures(sheet: Sheet, vertices: FramesOfVertices, pinned: Mask) -> dict[str, float]:
    """Returns edge strains over all frames, as fractions, without edges that are pinned at both ends.

    `edge_strain_p50`, `_p99` and `_max` count stretched and shortened edges alike. `edge_tension_p99` counts shortened
    edges as 0, `edge_compression_p99` counts stretched edges as 0. Edges shorten where cloth buckles within a triangle.
    """
    strain = strains(vertices, sheet.edges, sheet.edge_length.astype(np.float32))
    strain = strain[:, ~pinned[sheet.edges].all(axis=1)].ravel()
    middle, high, highest = np.percentile(np.abs(strain), [50, 99, 100])
    low, tension = np.percentile(strain, [1, 99])
    return {
        "edge_strain_p50": float(middle),
        "edge_strain_p99": float(high),
        "edge_strain_max": float(highest),
        "edge_tension_p99": max(float(tension), 0.0),
        "edge_compression_p99": max(-float(low), 0.0),
    }


CROSSINGS_EVERY = 5
"""Number of frames between two counts of self-crossings."""


def crossing_figures(sheet: Sheet, vertices: FramesOfVertices) -> dict[str, float]:
    """Returns the percentage of edges that cross a triangle of the cloth.

    `self_crossing_percent` is the mean over frames, `self_crossing_percent_max` the maximum. Every fifth frame is
    counted, by an exact test that the simulator does not use.
    """
    faces = sheet.faces.astype(np.int32)
    crossed = [len(crossing_edges(frame, faces)) for frame in vertices[::CROSSINGS_EVERY]]
    percent = 100 * np.array(crossed) / len(sheet.edges)
    return {"self_crossing_percent": float(np.mean(percent)), "self_crossing_percent_max": float(percent.max())}


def mean_or_zero(values: Sequence[float]) -> float:
    """Returns the mean, or 0 for no values."""
    return float(np.mean(values)) if len(values) else 0.0
