"""A clip that leads through given poses one after the other, so that a garment can be simulated in all of them."""

from itertools import pairwise

import numpy as np

from hemline.arrays import Float, Int

from .motion import Motion
from .pose_clusters import square_distances
from .quaternions import slerp


def order_poses(
    rotations: Float[np.ndarray, "poses joints 4"], weights: Float[np.ndarray, " joints"]
) -> Int[np.ndarray, " poses"]:
    """Returns an order of poses in which each is the nearest to the one before of those that are left.

    Args:
        rotations: Local rotations of each pose, unit quaternions.
        weights: Weight of each joint.
    """
    apart = square_distances(rotations, rotations, weights)
    left, order = np.ones(len(rotations), bool), [0] if len(rotations) else []
    left[order] = False
    while left.any():
        following = int(np.where(left, apart[order[-1]], np.inf).argmin())
        left[following] = False
        order.append(following)
    return np.array(order, int)


def pose_tour(
    rotations: Float[np.ndarray, "poses joints 4"],
    translation: Float[np.ndarray, "3"],
    frames: int,
    *,
    fps: float,
    leg_length: float,
    name: str,
) -> Motion:
    """Returns a clip that leads from each pose to the next, slowly at both ends.

    Args:
        rotations: Local rotations of each pose, unit quaternions.
        translation: Place of the pelvis in all poses [m].
        frames: Number of frames from one pose to the next: pose `k` is frame `k * frames`.
        fps: Frame rate [frames/s].
        leg_length: Length of the legs of the body [m].
        name: Name of the clip.
    """
    parts = [rotations[:1]]
    for first, second in pairwise(rotations):
        steps = np.arange(1, frames + 1) / frames
        eased = steps * steps * (3 - 2 * steps)
        parts.append(np.stack([slerp(first, second, fraction) for fraction in eased]))
    tour = np.concatenate(parts).astype(np.float32)
    places = np.tile(np.asarray(translation, np.float32), (len(tour), 1))
    return Motion(tour, places, fps=fps, leg_length=leg_length, name=name)
