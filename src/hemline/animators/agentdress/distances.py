"""Distances between poses per region, and the blend weights of anchors that follow from them."""

import numpy as np

from hemline.arrays import Float
from hemline.motions.quaternions import to_matrix


def axes_between(
    rotations: Float[np.ndarray, "poses joints 4"], anchors: Float[np.ndarray, "anchors joints 4"]
) -> Float[np.ndarray, "poses anchors axes"]:
    r"""Returns $|R e_c - R_s e_c|^2$, the squared distance between the axes of joint frames, three axes per joint."""
    matrices, anchor_matrices = to_matrix(rotations), to_matrix(anchors)
    return ((matrices[:, None] - anchor_matrices[None]) ** 2).sum(axis=-2).reshape(len(rotations), len(anchors), -1)


def axis_weights(influence: Float[np.ndarray, "regions joints 3"]) -> Float[np.ndarray, "regions axes"]:
    """Returns the weight of each joint axis, such that a small rotation counts as much as it moves cloth.

    A rotation by an angle about one axis moves the other two axes by that angle. Weights are not negative, even if one
    rotation outweighs the other two.

    Args:
        influence: Influence of rotations about each axis of each joint on each region.
    """
    half = 0.5 * influence.sum(axis=2, keepdims=True)
    return np.maximum(half - influence, 0.0).reshape(len(influence), -1)


def region_distances(
    axes: Float[np.ndarray, "poses anchors axes"], weights: Float[np.ndarray, "regions axes"]
) -> Float[np.ndarray, "poses regions anchors"]:
    r"""Returns $D_g^s(\theta) = \sum_{j,c} w_{g,j,c} |R_j e_c - R_{s,j} e_c|^2$, squared distances per region.

    Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations", 2021,
        Eq. 7. Differs: distances between the axes of joint frames instead of joint angles. They do not jump at half a
        turn, and as distances of points in space they make every kernel matrix invertible.
    """
    return np.einsum("psc,gc->pgs", axes, weights)


def anchor_weights(
    distances: Float[np.ndarray, "... anchors"], *, neighbours: int, power: float, floor: float
) -> Float[np.ndarray, "... anchors"]:
    r"""Returns $1 / (D^s + \epsilon)^k$ for the nearest anchors of a region, normalised; 0 for the others.

    Args:
        distances: Squared distance to each anchor.
        neighbours: Number of anchors with weight.
        power: The exponent $k$.
        floor: $\epsilon$, as a fraction of the median squared distance between anchors, which is 1 here.

    Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations", 2021,
        section 3.4 and Eq. 8.
    """
    neighbours = min(neighbours, distances.shape[-1])
    farthest = np.partition(distances, neighbours - 1, axis=-1)[..., neighbours - 1 : neighbours]
    # relative to the nearest, so that the power cannot overflow
    nearest = distances.min(axis=-1, keepdims=True) + floor
    weights = np.where(distances <= farthest, (nearest / (distances + floor)) ** power, 0.0)
    return weights / weights.sum(axis=-1, keepdims=True)
