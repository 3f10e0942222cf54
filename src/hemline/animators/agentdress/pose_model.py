"""The clothing pose model: from the pose to the garment on the mean shape, by kernel ridge regression in regions."""

from dataclasses import dataclass

import numpy as np

from hemline.arrays import Float, Int

POSE_WIDTHS = (0.5, 0.7, 1.0, 1.4, 2.0, 3.0, 5.0)
"""Widths of the kernel that are tried, over the median distance between anchors."""

POSE_RIDGES = (1e-4, 1e-3, 3e-3, 1e-2, 3e-2, 1e-1, 3e-1)
"""Regularisations that are tried."""


def kernel(distances: Float[np.ndarray, "... anchors"], width: float) -> Float[np.ndarray, "... anchors"]:
    r"""$1 / (1 + D / h^2)$ of squared distances; h in the unit of their root.

    Its long tail tells poses far from all others more than a Gaussian does.
    """
    return 1.0 / (1.0 + distances / np.asarray(width**2, distances.dtype))


@dataclass(frozen=True)
class PoseFit:
    """A kernel ridge regression in regions.

    Attributes:
        width: Of the kernel.
        ridge: Added to its diagonal.
        weights: What each anchor adds to each output, for each region.
        left_out: What is missed at each anchor by a fit without it and those that belong to it, for each region.
    """

    width: float
    ridge: float
    weights: Float[np.ndarray, "regions anchors outputs"]
    leave_one_out: Float[np.ndarray, "regions anchors outputs"]


def fit_kernel(
    distances: Float[np.ndarray, "anchors regions anchors"],
    outputs: Float[np.ndarray, "anchors outputs"],
    together: Int[np.ndarray, " anchors"],
    *,
    width: float,
    ridge: float,
) -> PoseFit:
    """Fit each region, and say what each anchor would miss if it were not there (in closed form).

    Args:
        distances: Between the anchors, squared, in each region.
        outputs: What is to be told, its mean over the anchors removed.
        together: A number for each anchor: neighbours that share one are left out together.
        width: Of the kernel.
        ridge: Added to its diagonal.
    """
    weights, left_out = [], []
    for region in range(distances.shape[1]):
        gram = kernel(distances[:, region], width) + ridge * np.eye(len(distances))
        inverse = np.linalg.inv(gram)
        found = inverse @ outputs
        weights.append(found)
        left_out.append(leave_groups_out(inverse, found, together))
    return PoseFit(width, ridge, np.stack(weights), np.stack(left_out))


def leave_groups_out(
    inverse: Float[np.ndarray, "rows rows"],
    weights: Float[np.ndarray, "rows outputs"],
    together: Int[np.ndarray, " rows"],
) -> Float[np.ndarray, "rows outputs"]:
    """What a kernel ridge regression misses of rows that are left out, neighbours that share a number at once.

    Args:
        inverse: Of its matrix.
        weights: The inverse times its outputs.
        together: The numbers.
    """
    blocks = np.split(np.arange(len(together)), np.flatnonzero(np.diff(together)) + 1)
    return np.concatenate([np.linalg.solve(inverse[np.ix_(block, block)], weights[block]) for block in blocks])
