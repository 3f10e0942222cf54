"""Percentage of garment vertices inside the posed body."""

from collections.abc import Sequence

import numpy as np

from hemline.arrays import Int, Mask


def inside_percent(inside: Mask, pinched: Int[np.ndarray, " pinched"] | None = None) -> float:
    """Returns the percentage of vertices of one frame that are inside and not pinched.

    A vertex is inside if the winding number of the posed mesh exceeds 0.5 (`collide.inside`).

    Args:
        inside: Whether each vertex is inside.
        pinched: Vertices without a place outside nearby because the body overlaps itself; only `pinched_percent`
            counts them.

    Returns:
        The percentage of the vertices.
    """
    counted = np.count_nonzero(inside)
    if pinched is not None:
        counted -= np.count_nonzero(inside[pinched])
    return 100.0 * counted / len(inside)


def pinched_percent(pinched: Int[np.ndarray, " pinched"], vertex_count: int) -> float:
    """Returns the percentage of vertices of one frame whose indices are in `pinched`: no place outside is nearby."""
    return 100.0 * len(pinched) / vertex_count


def inside_figures(before: Sequence[float], after: Sequence[float], pinched: Sequence[float]) -> dict[str, float]:
    """Summarises the vertices inside over a clip.

    Args:
        before: `inside_percent` of each frame before the projection.
        after: `inside_percent` of each frame after it.
        pinched: `pinched_percent` of each frame.

    Returns:
        `before`, `after` and `pinched`, means over the frames, and `worst_frame_after` [all in percent].
    """
    return {
        "before": float(np.mean(before)),
        "after": float(np.mean(after)),
        "worst_frame_after": float(np.max(after)),
        "pinched": float(np.mean(pinched)),
    }
