"""How near a pose is to each anchor, region by region, and what that makes of the anchors."""

import numpy as np

from hemline.arrays import Float
from hemline.motions.quaternions import inverse, multiply, to_axis_angle


def turns_between(
    rotations: Float[np.ndarray, "poses joints 4"], anchors: Float[np.ndarray, "anchors joints 4"]
) -> Float[np.ndarray, "poses anchors angles"]:
    r"""$\Theta_m(\theta, \theta_s)$: the three components of $\log(R_s^T R)$ of each joint [rad].

    Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations", 2021,
        Eq. 7. Differs: rotation vectors instead of joint angles, which wrap around.
    """
    way = to_axis_angle(multiply(inverse(anchors)[None], rotations[:, None]))
    return way.reshape(len(rotations), len(anchors), -1)


def region_distances(
    turns: Float[np.ndarray, "poses anchors angles"], influence: Float[np.ndarray, "regions angles"]
) -> Float[np.ndarray, "poses regions anchors"]:
    r"""$D_g^s(\theta) = \sum_m Q_{g,m} |\Theta_m(\theta, \theta_s)|^2$ (AgentDress, Eq. 7)."""
    return np.einsum("psm,gm->pgs", turns**2, influence)


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
