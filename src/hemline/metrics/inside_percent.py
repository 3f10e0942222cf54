"""The share of garment vertices inside the posed body."""

from collections.abc import Sequence

import numpy as np

from hemline.arrays import Int, Mask


def inside_percent(inside: Mask, pinched: Int[np.ndarray, " pinched"] | None = None) -> float:
    """Vertices of one frame that are inside, pinched ones left out.

    Inside is what has a winding number of the posed mesh above 0.5 (`collide.inside`).

    Args:
        inside: Whether each vertex is inside.
        pinched: Vertices where the body overlaps itself, so that there is no place outside for them nearby; counted
            by `pinched_percent` alone.

    Returns:
        The share [percent of the vertices].
    """
    counted = np.count_nonzero(inside)
    if pinched is not None:
        counted -= np.count_nonzero(inside[pinched])
    return 100.0 * counted / len(inside)


def pinched_percent(pinched: Int[np.ndarray, " pinched"], vertex_count: int) -> float:
    """Vertices of one frame that are pinched: without a place outside nearby [percent of the vertices]."""
    return 100.0 * len(pinched) / vertex_count


def inside_figures(before: Sequence[float], after: Sequence[float], pinched: Sequence[float]) -> dict[str, float]:
    """What frames have inside, over a clip.

    Args:
        before: `inside_percent` of each frame before the projection.
        after: The same after it.
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
