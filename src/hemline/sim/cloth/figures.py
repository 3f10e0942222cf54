"""Figures of trust: how far a take can be believed."""

from collections.abc import Sequence

import numpy as np

from hemline.arrays import FramesOfVertices, Mask
from hemline.meshes import crossing_edges, strains

from .sheet import Sheet


def strain_figures(sheet: Sheet, vertices: FramesOfVertices, pinned: Mask) -> dict[str, float]:
    """Strain over all frames, of edges that are not pinned at both ends, as shares.

    `edge_strain_p50`, `_p99`, `_max` count stretched and shortened edges alike; `edge_tension_p99` counts shortened
    ones as 0, `edge_compression_p99` stretched ones. Cloth shortens where it buckles within a triangle.
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
"""Frames from one count of self-crossings to the next."""


def crossing_figures(sheet: Sheet, vertices: FramesOfVertices) -> dict[str, float]:
    """Edges that pass through a triangle of the cloth, in percent: `self_crossing_percent` is the mean over frames,
    `self_crossing_percent_max` the worst; every fifth frame, by an exact test that the simulator does not use.
    """
    faces = sheet.faces.astype(np.int32)
    crossed = [len(crossing_edges(frame, faces)) for frame in vertices[::CROSSINGS_EVERY]]
    found = 100 * np.array(crossed) / len(sheet.edges)
    return {"self_crossing_percent": float(np.mean(found)), "self_crossing_percent_max": float(found.max())}


def mean_or_zero(values: Sequence[float]) -> float:
    """The mean, 0 of none."""
    return float(np.mean(values)) if len(values) else 0.0
