"""Clusters poses by weighted k-means on the rotations of the joints."""

from dataclasses import dataclass

import numpy as np

from hemline.arrays import Float, Int
from hemline.errors import BadInput

from .quaternions import from_axis_angle, heading, inverse, multiply, normalise, to_axis_angle

ROUNDS = 50
"""Largest number of rounds of k-means."""
MEAN_STEPS = 5
"""Number of steps towards a mean in each round."""
DIFFERENT = 1e-9
"""Square distance above which two poses differ."""


@dataclass(frozen=True)
class PoseClusters:
    """Poses sorted into clusters.

    Attributes:
        means: Mean rotations of each cluster, unit quaternions; these are not actual poses.
        members: Poses of each cluster, the nearest to its mean first: that one represents it.
        residual: Mean square distance to the cluster means, as a fraction of that to the mean of all poses.
    """

    means: Float[np.ndarray, "clusters joints 4"]
    members: tuple[Int[np.ndarray, " _members"], ...]
    residual: float


def without_heading(rotations: Float[np.ndarray, "poses joints 4"]) -> Float[np.ndarray, "poses joints 4"]:
    """Turns poses to one heading; the tilt of the root is kept, as gravity depends on it."""
    result = np.array(rotations, np.float64)
    result[:, 0] = multiply(inverse(heading(result[:, 0])), result[:, 0])
    return result


def square_distances(
    first: Float[np.ndarray, "poses joints 4"],
    second: Float[np.ndarray, "others joints 4"],
    weights: Float[np.ndarray, " joints"],
) -> Float[np.ndarray, "poses others"]:
    r"""Returns $\sum_j w_j |\log(R_{2,j}^T R_{1,j})|^2$ between poses [rad^2 times the unit of the weights]."""
    total = np.zeros((len(first), len(second)))
    for joint in np.flatnonzero(weights):
        cosine = np.abs(first[:, joint] @ second[:, joint].T)
        total += weights[joint] * (2 * np.arccos(np.minimum(cosine, 1.0))) ** 2
    return total


def cluster_poses(
    rotations: Float[np.ndarray, "poses joints 4"], weights: Float[np.ndarray, " joints"], count: int, *, seed: int = 0
) -> PoseClusters:
    """Sorts poses into clusters, regardless of their heading.

    Args:
        rotations: Local rotations of each pose, unit quaternions.
        weights: Weight of each joint, not negative; at least one is positive.
        count: Number of clusters.
        seed: Seed of the first means.

    Returns:
        The clusters, largest first.

    Raises:
        BadInput: There are fewer distinct poses than clusters, no positive weight, or a negative one.

    Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations", 2021,
        section 3.6 (weighted k-means). Differs: distances and means are those of rotations, not of joint angles; the
        pose nearest to its mean represents a cluster, so it is an actual pose; k-means++ chooses the first means.
    """
    weights = np.asarray(weights, np.float64)
    if not (np.isfinite(weights).all() and (weights >= 0).all() and weights.any()):
        raise BadInput("weights of joints are not negative, and one is positive", weights.tolist(), "give such weights")
    poses = without_heading(rotations)
    if not 1 <= count <= len(np.unique(poses.round(9).reshape(len(poses), -1), axis=0)):
        raise BadInput("clusters must be at least 1, and at most as many as poses that differ", count, "add clips")
    means = _first_means(poses, weights, count, np.random.default_rng(seed))
    owner = np.full(len(poses), -1)
    for _ in range(ROUNDS):
        away = square_distances(poses, means, weights)
        nearest = away.argmin(axis=1)
        for empty in np.setdiff1d(np.arange(count), nearest):
            # a cluster that lost all its poses begins anew where they are farthest from any mean
            alone = int(np.where(np.bincount(nearest, minlength=count)[nearest] > 1, away.min(axis=1), -1.0).argmax())
            nearest[alone] = empty
        if np.array_equal(nearest, owner):
            break
        owner = nearest
        means = _means(poses, owner, means)
    away = square_distances(poses, means, weights)
    members = [np.flatnonzero(owner == k) for k in range(count)]
    members = [each[np.argsort(away[each, k], kind="stable")] for k, each in enumerate(members)]
    order = np.argsort([-len(each) for each in members], kind="stable")
    one = _means(poses, np.zeros(len(poses), int), poses[:1])
    left = away[np.arange(len(poses)), owner].sum() / max(float(square_distances(poses, one, weights).sum()), 1e-12)
    return PoseClusters(means[order], tuple(members[k] for k in order), float(left))


def farthest_poses(
    rotations: Float[np.ndarray, "poses joints 4"],
    known: Float[np.ndarray, "known joints 4"],
    weights: Float[np.ndarray, " joints"],
    count: int,
) -> Int[np.ndarray, " count"]:
    """Chooses poses one after the other, each the farthest from all known and chosen ones, regardless of heading.

    The middle of a cluster is a common pose. These are the rare ones, such as the top of a kick.

    Args:
        rotations: Local rotations of each pose, unit quaternions.
        known: Local rotations of poses that need not be chosen; at least one.
        weights: Weight of each joint, not negative.
        count: Number of poses to choose.

    Returns:
        Numbers of the chosen poses, in order of choice; fewer than `count` if no others differ from these.

    Source: Gonzalez, "Clustering to minimize the maximum intercluster distance", 1985.
    """
    poses, chosen = without_heading(rotations), []
    away = square_distances(poses, without_heading(known), weights).min(axis=1)
    while len(chosen) < count and away.max(initial=0.0) > DIFFERENT:
        chosen.append(int(away.argmax()))
        away = np.minimum(away, square_distances(poses, poses[chosen[-1:]], weights)[:, 0])
        away[chosen] = 0.0
    return np.asarray(chosen, int)


def _first_means(poses: np.ndarray, weights: np.ndarray, count: int, random: np.random.Generator) -> np.ndarray:
    """Chooses the first means by k-means++: each is a pose drawn with its square distance to those before as weight."""
    chosen = [int(random.integers(len(poses)))]
    away = square_distances(poses, poses[chosen], weights)[:, 0]
    while len(chosen) < count:
        away[chosen] = 0.0
        spread = away if away.any() else np.isin(np.arange(len(poses)), chosen, invert=True).astype(float)
        chosen.append(int(random.choice(len(poses), p=spread / spread.sum())))
        away = np.minimum(away, square_distances(poses, poses[chosen[-1:]], weights)[:, 0])
    return poses[chosen]


def _means(poses: np.ndarray, owner: np.ndarray, means: np.ndarray) -> np.ndarray:
    """Returns means of rotations (Karcher), where the rotation vectors to all poses of a cluster cancel out."""
    count = np.bincount(owner, minlength=len(means))
    for _ in range(MEAN_STEPS):
        rotation_vectors = to_axis_angle(multiply(inverse(means[owner]), poses))
        total = np.zeros((*means.shape[:2], 3))
        np.add.at(total, owner, rotation_vectors)
        means = normalise(multiply(means, from_axis_angle(total / np.maximum(count, 1)[:, None, None])))
    return means
