"""Figures of trust: how far a take can be believed."""

from collections.abc import Sequence

import numpy as np

from hemline.arrays import FramesOfVertices, Mask

from .sheet import Sheet


def edge_strain(sheet: Sheet, vertices: FramesOfVertices) -> np.ndarray:
    """|length / rest length - 1| of each edge in each frame.

    Args:
        sheet: Edges and their rest lengths.
        vertices: Frames [m].
    """
    ends = vertices[:, sheet.edges]
    length = np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=-1)
    return np.abs(length / sheet.edge_length.astype(np.float32) - 1)


def strain_figures(sheet: Sheet, vertices: FramesOfVertices, fixed: Mask) -> dict[str, float]:
    """`edge_strain_p50`, `_p99`, `_max` over all frames, of edges that are not pinned at both ends, as shares."""
    strain = edge_strain(sheet, vertices)[:, ~fixed[sheet.edges].all(axis=1)].ravel()
    middle, high = np.percentile(strain, [50, 99])
    return {
        "edge_strain_p50": float(middle), "edge_strain_p99": float(high), "edge_strain_max": float(strain.max()),
    }  # fmt: skip


def mean_or_zero(values: Sequence[float]) -> float:
    """The mean, 0 of none."""
    return float(np.mean(values)) if len(values) else 0.0
