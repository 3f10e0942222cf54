"""The share of garment vertices inside the posed body."""

import numpy as np

from hemline.arrays import Bool


def inside_percent(
    inside: Bool[np.ndarray, "frames verts"], pinched: Bool[np.ndarray, "frames verts"] | None = None
) -> dict[str, float]:
    """Vertices with a winding number of the posed body above one half, over all frames, pinched ones apart.

    Args:
        inside: Whether each vertex is inside, frame by frame.
        pinched: Whether it is where the body overlaps itself, so that there is no place outside for it nearby; such
            vertices count in `pinched` only.

    Returns:
        `mean` over the frames and `worst_frame` of the vertices inside and not pinched; `pinched`, mean over the
        frames [all in percent of the vertices].
    """
    pinched = np.zeros_like(inside) if pinched is None else pinched
    share = 100 * (inside & ~pinched).mean(axis=1)
    return {"mean": float(share.mean()), "worst_frame": float(share.max()), "pinched": float(100 * pinched.mean())}
