"""The frame of a garment's key joint: the rigid motion that is removed before anything is learned."""

import numpy as np

from hemline.arrays import Float, Points


def to_key(transform: Float[np.ndarray, "3 4"], points: Points) -> Points:
    """World to key frame: `R^T (x - t)`, in the dtype of the points.

    Args:
        transform: `[R | t]` that takes the rest pose's world to this pose's.
        points: Positions in the world [m].

    Source: Jin, Omens, Geng, Teran, Kumar, Tashiro, Fedkiw, "A Neural-Network-Based Approach for Loose-Fitting
        Clothing", 2024, Section 7 (rigid displacement of a key body part).
    """
    return (points - transform[:, 3]) @ transform[:, :3]
