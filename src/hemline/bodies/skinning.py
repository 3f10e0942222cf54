"""Move points with the joints: linear and dual-quaternion blending."""

from typing import Literal

import numpy as np
from jaxtyping import Float, Int

from hemline.arrays import Points, Transforms

from .dual_quaternion_kernels import dual_quaternions, skin_dual
from .skinning_kernels import skin_linear

Blending = Literal["linear", "dual"]
"""How transforms are blended: `linear` (fast, shrinks where a joint twists) or `dual` quaternions (keeps volume)."""


def skin_points(
    transforms: Transforms,
    weight_indices: Int[np.ndarray, "points influences"],
    weights: Float[np.ndarray, "points influences"],
    points: Points,
    *,
    blending: Blending = "linear",
) -> Points:
    r"""Points moved by the joints that hold them.

    $$p_i' = \sum_j w_{ij} A_j p_i$$

    or, with dual quaternions, the rigid transform of $\sum_j w_{ij} \hat q_j$ made unit.

    Args:
        transforms: Skin transforms $A_j$, as `PosedBody.transforms`, float32.
        weight_indices: Joints of each point, int32.
        weights: Their shares, float32, sum 1; what follows a 0 is not read.
        points: Points at rest, float32 [m].
        blending: `linear` or `dual`.

    Returns:
        Points posed [m].

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
