"""Capsules around the bones of a body; the neural distance reads how near a point is to each."""

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Self

import numpy as np

from hemline.arrays import Float, Points
from hemline.motions import JOINT_NAMES

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody


@dataclass(frozen=True, eq=False)
class BoneCapsules:
    """One capsule for each joint, in the body's rest pose: from the joint through the flesh that moves with it.

    Attributes:
        starts: Joints at rest [m], float32.
        ends: The other end of each axis, twice as far as the mean of the vertices that the joint moves most [m],
            float32.
        radii: Mean distance of these vertices from the axis [m], float32.
    """

    starts: Float[np.ndarray, "joints 3"]
    ends: Float[np.ndarray, "joints 3"]
    radii: Float[np.ndarray, " joints"]

    @classmethod
    def of(cls, shaped: "ShapedBody") -> Self:
        """Makes the capsules of a shaped body."""
        order, first = _flesh(shaped.body.weight_indices[:, 0].tobytes())
        counts = np.diff(np.append(first, len(order)))
        flesh = shaped.vertices[order]
        middles = np.add.reduceat(flesh, first) / counts[:, None].astype(np.float32)
        ends = 2 * middles - shaped.joints
        owner = np.repeat(np.arange(len(first)), counts)
        distances, _ = axis_distances(flesh, shaped.joints[owner], ends[owner])
        return cls(shaped.joints, ends, np.add.reduceat(distances, first) / counts.astype(np.float32))


def axis_distances(
    points: Points, starts: Points, ends: Points
) -> tuple[Float[np.ndarray, " points"], Float[np.ndarray, "points 3"]]:
    """Returns the distance of each point from its own segment [m], and the unit vector away from it."""
    along = ends - starts
    fraction = ((points - starts) * along).sum(-1) / np.maximum((along * along).sum(-1), 1e-12)
    away = points - starts - np.clip(fraction, 0, 1)[..., None] * along
    distances = np.sqrt((away * away).sum(-1) + 1e-12)
    return distances, away / distances[..., None]


@lru_cache(maxsize=4)
def _flesh(strongest: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Returns vertices sorted by the joint that moves them most, and where those of each joint begin."""
    joint = np.frombuffer(strongest, np.int32)
    order = np.argsort(joint, kind="stable")
    return order, np.searchsorted(joint[order], np.arange(len(JOINT_NAMES)))
