"""What the shape of the body adds in any pose: kernel ridge regression over pose and shape together, in regions."""

from dataclasses import dataclass

import numpy as np

from hemline.arrays import Float

from .left_out import left_out_mm
from .pose_model import kernel
from .shape_model import shape_features

WIDTHS = (0.7, 1.0, 1.4, 2.0)
"""Widths of the kernel that are tried, over the median distance between anchors."""

RIDGES = (0.1, 0.3, 1.0, 3.0)
"""Regularisations that are tried [products of betas]."""

SQUARES = 0.5
"""What the square of a beta counts for beside the beta."""


@dataclass(frozen=True)
class ShapeKernelFit:
    r"""$\sum_s K(D_g^s(\theta))\, E_{g,s} (\beta, \beta^2)$: nothing at $\beta = 0$.

    Attributes:
        width: Of the kernel over poses.
        ridge: Added to the diagonal.
        effects: $E$: what each feature of the shape adds to each output at each anchor, for each region.
        left_out: What is missed at each anchor, on all its shapes, by a fit to the other anchors.
    """

    width: float
    ridge: float
    effects: Float[np.ndarray, "features regions anchors outputs"]
    left_out: Float[np.ndarray, "regions anchors shapes outputs"]


def best_shape_kernel(
    distances: Float[np.ndarray, "anchors regions anchors"],
    betas: Float[np.ndarray, "shapes betas"],
    changes: Float[np.ndarray, "anchors shapes outputs"],
    basis: Float[np.ndarray, "outputs rows"],
    regions: Float[np.ndarray, "verts regions"],
) -> tuple[ShapeKernelFit, float]:
    """The width and ridge that miss least at anchors that are left out, and what they miss [mm].

    Args:
        distances: Between the anchors, squared, in each region.
        betas: The shapes, without the mean one.
        changes: What each shape adds to the mean one at each anchor, as coefficients of `basis` [m].
        basis: Directions of the garment, one a row.
        regions: Share of each region in each vertex.
    """
    best: tuple[float, ShapeKernelFit] | None = None
    for width in WIDTHS:
        for ridge in RIDGES:
            found = fit_shape_kernel(distances, betas, changes, width=width, ridge=ridge)
            missed = left_out_mm(found.left_out.reshape(len(found.left_out), -1, len(basis)), basis, regions)
            if best is None or missed < best[0]:
                best = missed, found
    assert best is not None
    return best[1], best[0]


def fit_shape_kernel(
    distances: Float[np.ndarray, "anchors regions anchors"],
    betas: Float[np.ndarray, "shapes betas"],
    changes: Float[np.ndarray, "anchors shapes outputs"],
    *,
    width: float,
    ridge: float,
) -> ShapeKernelFit:
    r"""Ridge regression with the kernel $K(D(\theta, \theta'))\, \phi(\beta) \cdot \phi(\beta')$.

    Every anchor has every shape, so the kernel matrix is a Kronecker product: the eigenvectors of its two factors
    solve it, and give the blocks of its inverse that tell what an anchor would miss if it were not there. Distances
    between rotations are not quite Euclidean: directions of negative eigenvalues over poses, if there are any, are left
    out.

    Args:
        distances: Between the anchors, squared, in each region.
        betas: The shapes, without the mean one.
        changes: What each shape adds to the mean one at each anchor.
        width: Of the kernel over poses.
        ridge: Added to the diagonal.

    Source: the joint treatment of pose and shape that Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual
        Agents using Plausible Deformations", 2021, section 6, leave open, in the place of Eq. 4's blend of the nearest
        anchors.
    """
    scale = np.repeat([1.0, SQUARES], betas.shape[1])
    features = scale * shape_features(betas.astype(np.float64))
    over_shapes, shapes = np.linalg.eigh(features @ features.T)
    over_shapes = np.maximum(over_shapes, 0.0)  # rounding
    effects, left_out = [], []
    for region in range(distances.shape[1]):
        over_poses, poses = np.linalg.eigh(kernel(distances[:, region].astype(np.float64), width))
        inverse = 1.0 / (np.outer(np.maximum(over_poses, 0.0), over_shapes) + ridge)
        turned = np.einsum("ap,atk,tq->pqk", poses, changes, shapes, optimize=True)
        solved = inverse[:, :, None] * turned
        played = np.where(over_poses[:, None, None] > 0, solved, 0.0)
        effects.append(np.einsum("tf,tq,ap,pqk->fak", features, shapes, poses, played, optimize=True))
        missed = np.einsum("ap,pqk->aqk", poses, solved, optimize=True) / (poses**2 @ inverse)[:, :, None]
        left_out.append(np.einsum("tq,aqk->atk", shapes, missed, optimize=True))
    stacked = np.einsum("f,gfak->fgak", scale, np.stack(effects))
    return ShapeKernelFit(width, ridge, stacked, np.stack(left_out))
