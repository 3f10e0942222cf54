"""The frame of a garment's key joint, whose rigid motion is removed before anything is learned."""

import numpy as np

from hemline.arrays import Float, Points


def to_key_frame(transform: Float[np.ndarray, "3 4"], points: Points) -> Points:
    """Moves points from the world into the key frame: `R^T (x - t)`, in the dtype of the points.

    Args:
        transform: `[R | t]`, from the world of the rest pose to that of this pose.
        points: Positions in the world [m].

    Source: Jin, Omens, Geng, Teran, Kumar, Tashiro, Fedkiw, "A Neural-Network-Based Approach for Loose-Fitting
        Clothing", 2024, Section 7 (rigid displacement of a key body part).
    """
    return (points - transform[:, 3]) @ transform[:, :3]
