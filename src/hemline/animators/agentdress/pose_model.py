"""The clothing pose model: kernel ridge regression per region from the pose to the garment on the mean shape."""

from dataclasses import dataclass

import numpy as np

from hemline.arrays import Float, Int
from hemline.learning.compensated_rounding import round_to_half

POSE_WIDTHS = (0.5, 0.7, 1.0, 1.4, 2.0, 3.0, 5.0)
"""Candidate kernel widths, relative to the median distance between anchors."""

POSE_RIDGES = (1e-4, 1e-3, 3e-3, 1e-2, 3e-2, 1e-1, 3e-1)
"""Candidate ridge penalties."""


def kernel(distances: Float[np.ndarray, "... anchors"], width: float) -> Float[np.ndarray, "... anchors"]:
    r"""Returns $1 / (1 + D / h^2)$ of squared distances $D$, with the width $h$ in the unit of their root.

    With its long tail it predicts poses far from all others better than a Gaussian.
    """
    return 1.0 / (1.0 + distances / np.asarray(width**2, distances.dtype))


@dataclass(frozen=True)
class PoseFit:
    """A kernel ridge regression per region.

    Attributes:
        width: Width of the kernel.
        ridge: Penalty added to the diagonal of the kernel matrix.
        weights: Regression weights of each anchor, per region.
        leave_one_out: Residual at each anchor of a fit without its group, per region.
    """

    width: float
    ridge: float
    weights: Float[np.ndarray, "regions anchors outputs"]
    leave_one_out: Float[np.ndarray, "regions anchors outputs"]


def fit_kernel(
    distances: Float[np.ndarray, "anchors regions anchors"],
    outputs: Float[np.ndarray, "anchors outputs"],
    groups: Int[np.ndarray, " anchors"],
    *,
    width: float,
    ridge: float,
    rounded: bool = False,
) -> PoseFit:
    """Fits each region, and computes leave-one-out residuals in closed form.

    Args:
        distances: Squared distances between the anchors, per region.
        outputs: Targets, with their mean over the anchors removed.
        groups: Group number of each anchor; neighbours in one group are left out together.
        width: Width of the kernel.
        ridge: Penalty added to the diagonal.
        rounded: Whether weights are rounded to half precision, as a model file stores them; see `round_to_half`.
    """
    weights, residuals = [], []
    for region in range(distances.shape[1]):
        gram = kernel(distances[:, region], width) + ridge * np.eye(len(distances))
        inverse = invert_definite(gram)
        solution = inverse @ outputs
        weights.append(round_to_half(solution, inverse) if rounded else solution)
        residuals.append(leave_groups_out(inverse, solution, groups))
    return PoseFit(width, ridge, np.stack(weights), np.stack(residuals))


def invert_definite(matrix: Float[np.ndarray, "rows rows"]) -> Float[np.ndarray, "rows rows"]:
    """Returns the inverse of a symmetric positive definite matrix, from its Cholesky factor.

    Raises:
        np.linalg.LinAlgError: The matrix is not positive definite.
    """
    from scipy.linalg.lapack import dpotrf, dpotri

    factor, failed = dpotrf(np.asarray(matrix, np.float64), lower=1)
    inverse, failed_too = dpotri(factor, lower=1) if not failed else (factor, 0)
    if failed or failed_too:
        raise np.linalg.LinAlgError("the matrix is not positive definite")
    return np.tril(inverse) + np.tril(inverse, -1).T


def leave_groups_out(
    inverse: Float[np.ndarray, "rows rows"],
    weights: Float[np.ndarray, "rows outputs"],
    groups: Int[np.ndarray, " rows"],
) -> Float[np.ndarray, "rows outputs"]:
    """Returns the residual of each row for a kernel ridge regression without the group of that row.

    Args:
        inverse: Inverse of the regularised kernel matrix.
        weights: The inverse times the outputs.
        groups: Group number of each row; the rows of a group are consecutive.
    """
    sizes = np.diff(np.flatnonzero(np.diff(groups, prepend=-1, append=-1)))
    if len(sizes) and (sizes == sizes[0]).all():  # as with mirror images: all blocks at once
        each = np.arange(len(groups)).reshape(-1, sizes[0])
        solved = np.linalg.solve(inverse[each[:, :, None], each[:, None, :]], weights[each])
        return solved.reshape(weights.shape)
    blocks = np.split(np.arange(len(groups)), np.flatnonzero(np.diff(groups)) + 1)
    return np.concatenate([np.linalg.solve(inverse[np.ix_(block, block)], weights[block]) for block in blocks])
