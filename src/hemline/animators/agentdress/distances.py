"""How near a pose is to each anchor, region by region, and what that makes of the anchors."""

import numpy as np

from hemline.arrays import Float
from hemline.motions.quaternions import to_matrix


def axes_between(
    rotations: Float[np.ndarray, "poses joints 4"], anchors: Float[np.ndarray, "anchors joints 4"]
) -> Float[np.ndarray, "poses anchors axes"]:
    r"""$|R e_c - R_s e_c|^2$: how far each axis of each joint's frame has turned away, squared, three axes a joint."""
    here, there = to_matrix(rotations), to_matrix(anchors)
    return ((here[:, None] - there[None]) ** 2).sum(axis=-2).reshape(len(rotations), len(anchors), -1)


def axis_weights(influence: Float[np.ndarray, "regions joints 3"]) -> Float[np.ndarray, "regions axes"]:
    """What each axis of a joint's frame counts for, so that a small turn about one counts as much as it moves cloth.

    A turn by an angle about one axis moves the other two by that angle. Where one turn outweighs the other two, its own
    axis cannot count for less than nothing.

    Args:
        influence: Of turns about each axis of each joint, on each region.
    """
    half = 0.5 * influence.sum(axis=2, keepdims=True)
    return np.maximum(half - influence, 0.0).reshape(len(influence), -1)


def region_distances(
    axes: Float[np.ndarray, "poses anchors axes"], weights: Float[np.ndarray, "regions axes"]
) -> Float[np.ndarray, "poses regions anchors"]:
    r"""$D_g^s(\theta) = \sum_{j,c} w_{g,j,c} |R_j e_c - R_{s,j} e_c|^2$: squared distances in each region.

    Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations", 2021,
        Eq. 7. Differs: distances between the axes of the joints' frames instead of joint angles. They have no jump at
        half a turn, and are those of points in space, so that every kernel of them can be inverted.
    """
    return np.einsum("psc,gc->pgs", axes, weights)


def anchor_weights(
    distances: Float[np.ndarray, "... anchors"], *, neighbours: int, power: float, floor: float
) -> Float[np.ndarray, "... anchors"]:
    r"""$1 / (D^s + \epsilon)^k$ of the nearest anchors of a region, summing to 1; 0 of the others.

    Args:
        distances: To each anchor, squared.
        neighbours: How many anchors count.
        power: k.
        floor: epsilon, as a share of the median distance between anchors, which is 1 here.

    Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations", 2021,
        section 3.4 and Eq. 8.
    """
    neighbours = min(neighbours, distances.shape[-1])
    farthest = np.partition(distances, neighbours - 1, axis=-1)[..., neighbours - 1 : neighbours]
    # over the nearest, so that the power cannot overflow
    nearest = distances.min(axis=-1, keepdims=True) + floor
    weights = np.where(distances <= farthest, (nearest / (distances + floor)) ** power, 0.0)
    return weights / weights.sum(axis=-1, keepdims=True)
