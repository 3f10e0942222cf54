"""Capsules around the bones of a shape: in whose frames a point is seen, and how near each bone is."""

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
    """One capsule a joint, in the body's rest pose: from the joint through the flesh that moves with it.

    Attributes:
        starts: The joints at rest [m], float32.
        ends: Twice as far as the middle of the vertices that each joint moves most [m], float32.
        radii: Mean distance of these vertices from the axis [m], float32.
    """

    starts: Float[np.ndarray, "joints 3"]
    ends: Float[np.ndarray, "joints 3"]
    radii: Float[np.ndarray, " joints"]

    @classmethod
    def of(cls, shaped: "ShapedBody") -> Self:
        """The capsules of a shape."""
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
    """Distance of each point from a segment of its own [m], and the unit vector away from it."""
    along = ends - starts
    share = ((points - starts) * along).sum(-1) / np.maximum((along * along).sum(-1), 1e-12)
    away = points - starts - np.clip(share, 0, 1)[..., None] * along
    distances = np.sqrt((away * away).sum(-1) + 1e-12)
    return distances, away / distances[..., None]


@lru_cache(maxsize=4)
def _flesh(strongest: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Vertices sorted by the joint that moves them most, and where each joint's begin."""
    joint = np.frombuffer(strongest, np.int32)
    order = np.argsort(joint, kind="stable")
    return order, np.searchsorted(joint[order], np.arange(len(JOINT_NAMES)))
