"""Skinning: moves points with the joints, by linear or dual-quaternion blending."""

from typing import Literal

import numpy as np
from jaxtyping import Float, Int

from hemline.arrays import Points, Transforms

from .dual_quaternion_kernels import dual_quaternions, skin_dual
from .skinning_kernels import skin_linear

Blending = Literal["linear", "dual"]
"""Blending of transforms: `linear` (fast, shrinks where a joint twists) or `dual` quaternions (keeps volume)."""


def skin_points(
    transforms: Transforms,
    weight_indices: Int[np.ndarray, "points influences"],
    weights: Float[np.ndarray, "points influences"],
    points: Points,
    *,
    blending: Blending = "linear",
) -> Points:
    r"""Moves points with the joints that they follow.

    $$p_i' = \sum_j w_{ij} A_j p_i$$

    or, with dual quaternions, the rigid transform of $\sum_j w_{ij} \hat q_j$ made unit.

    Args:
        transforms: Skin transforms $A_j$, as `PosedBody.transforms`, float32.
        weight_indices: Joints of each point, int32.
        weights: Weights of these joints, float32, with sum 1; entries after a 0 are not read.
        points: Points at rest, float32 [m].
        blending: `linear` or `dual`.

    Returns:
        Posed points, float32 [m].

    Source: Kavan, Collins, Zara, O'Sullivan, "Skinning with dual quaternions", 2007, algorithm 1.
    """
    posed = np.empty(points.shape, dtype=np.float32)
    if blending == "linear":
        skin_linear(transforms, weight_indices, weights, points, posed)
    else:
        duals = np.empty((len(transforms), 8), dtype=np.float32)
        dual_quaternions(transforms, duals)
        skin_dual(transforms, duals, weight_indices, weights, points, posed)
    return posed
