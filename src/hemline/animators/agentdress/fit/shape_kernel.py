"""What the shape of the body adds in any pose: kernel ridge regression over pose and shape together, in regions."""

from dataclasses import dataclass

import numpy as np

from hemline.animators.agentdress.pose_model import kernel, leave_groups_out
from hemline.animators.agentdress.shape_samples import SHAPE_LENGTH_SCALE, kernel_over_shapes
from hemline.arrays import Float, Int

from .leave_one_out import leave_one_out_mm

SHAPE_WIDTHS = (1.0, 1.4, 2.0, 3.0)
"""Widths of the kernel that are tried, over the median distance between anchors."""

SHAPE_RIDGES = (0.3, 1.0, 3.0, 10.0)
"""Regularisations that are tried [squares of betas]."""


@dataclass(frozen=True)
class ShapeChanges:
    """What shapes add to the mean one.

    Attributes:
        poses: In which pose each body was settled, rising.
        where: Its shape, as distances are taken of it: scaled betas, see `shape_scale`.
        outputs: What it adds to the mean one there, as coefficients of a basis [m].
        together: A number for each body: neighbours that share one are left out together, all in one pose at least.
    """

    poses: Int[np.ndarray, " samples"]
    coordinates: Float[np.ndarray, "samples betas"]
    outputs: Float[np.ndarray, "samples outputs"]
    groups: Int[np.ndarray, " samples"]


@dataclass(frozen=True)
class ShapeKernelFit:
    r"""$\sum_i \alpha_{g,i} K(D_g^{s_i}(\theta))\, k(\beta_i, \beta)$: nothing at $\beta = 0$.

    Attributes:
        width: Of the kernel over poses.
        ridge: Added to the diagonal.
        weights: $\alpha$: what each body counts for, in each region.
        left_out: What is missed of each body by a fit without all those that belong to it.
    """

    width: float
    ridge: float
    weights: Float[np.ndarray, "regions samples outputs"]
    leave_one_out: Float[np.ndarray, "regions samples outputs"]


def best_shape_kernel(
    distances: Float[np.ndarray, "poses regions poses"],
    changes: ShapeChanges,
    basis: Float[np.ndarray, "outputs rows"],
    regions: Float[np.ndarray, "verts regions"],
) -> tuple[ShapeKernelFit, float]:
    """The width and ridge that miss least in poses that are left out, and what they miss [mm].

    Args:
        distances: Between the poses, squared, in each region.
        changes: What is learned from.
        basis: Directions of the garment, one a row.
        regions: Share of each region in each vertex.
    """
    best: tuple[float, ShapeKernelFit] | None = None
    for width in SHAPE_WIDTHS:
        for ridge in SHAPE_RIDGES:
            found = fit_shape_kernel(distances, changes, width=width, ridge=ridge)
            missed = leave_one_out_mm(found.leave_one_out, basis, regions)
            if best is None or missed < best[0]:
                best = missed, found
    assert best is not None
    return best[1], best[0]


def fit_shape_kernel(
    distances: Float[np.ndarray, "poses regions poses"], changes: ShapeChanges, *, width: float, ridge: float
) -> ShapeKernelFit:
    r"""Ridge regression with the kernel $K(D(\theta, \theta'))\, k(\beta, \beta')$; see `kernel_over_shapes`.

    Args:
        distances: Between the poses, squared, in each region.
        changes: What is learned from.
        width: Of the kernel over poses.
        ridge: Added to the diagonal.

    Source: the joint treatment of pose and shape that Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual
        Agents using Plausible Deformations", 2021, section 6, leave open, in the place of Eq. 4's blend of the nearest
        anchors. What poses left out miss: the blocks of the inverse on its diagonal.
    """
    from scipy.linalg import cho_factor, cho_solve

    poses, outputs, identity = changes.poses, changes.outputs, np.eye(len(changes.poses))
    between = kernel_over_shapes(changes.coordinates, changes.coordinates, SHAPE_LENGTH_SCALE)
    weights, left_out = [], []
    for region in range(distances.shape[1]):
        gram = kernel(distances[:, region].astype(np.float64), width)[np.ix_(poses, poses)] * between
        inverse = cho_solve(cho_factor(gram + ridge * identity), identity)
        solved = inverse @ outputs
        weights.append(solved)
        left_out.append(leave_groups_out(inverse, solved, changes.groups))
    return ShapeKernelFit(width, ridge, np.stack(weights), np.stack(left_out))
