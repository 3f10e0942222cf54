"""Chains of spring bones with the constants of VRM, and the capsules that they collide with."""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Self

import numpy as np

from hemline.arrays import Float, Int, Points

OUTWARD_LIMIT = 2.4
"""Largest angle by which a limited bone swings outwards from its direction at rest [rad]."""


@dataclass(frozen=True, eq=False)
class SpringChains:
    """Chains of bones that swing, each from root to tip, with the constants of VRM.

    Each bone but the last of a chain is a joint of VRM, whose tail is the next bone. Constants are stored at the tail.

    Attributes:
        bones: Positions of the bones at rest [m].
        offsets: First bone of each chain, followed by the number of all bones.
        joints: The joint of the body that carries each chain.
        outward: Horizontal direction of each chain at rest, away from the axis of the body; unit length.
        stiffness: Pull of each bone towards its direction at rest [m/s per frame].
        gravity: Downward pull of each bone [m/s per frame].
        drag: Fraction of its velocity that each bone loses per frame [1].
        radii: Distance of each bone from colliders [m].
        inward: Largest angle by which each bone swings inwards from its direction at rest [rad].
        sideways: Largest angle by which each bone swings sideways [rad].
    """

    bones: Points
    offsets: Int[np.ndarray, " chains_and_one"]
    joints: Int[np.ndarray, " chains"]
    outward: Float[np.ndarray, "chains 3"]
    stiffness: Float[np.ndarray, " points"]
    gravity: Float[np.ndarray, " points"]
    drag: Float[np.ndarray, " points"]
    radii: Float[np.ndarray, " points"]
    inward: Float[np.ndarray, " points"]
    sideways: Float[np.ndarray, " points"]

    @classmethod
    def at_rest(
        cls,
        bones: Points,
        offsets: Int[np.ndarray, " chains_and_one"],
        joints: Int[np.ndarray, " chains"],
        outward: Float[np.ndarray, "chains 3"],
    ) -> Self:
        """Returns chains that nothing pulls, slows or limits.

        Args:
            bones: Positions of the bones at rest [m].
            offsets: First bone of each chain, followed by the number of all bones.
            joints: The joint of the body that carries each chain.
            outward: Horizontal direction of each chain, away from the axis of the body; unit length.
        """
        none, free = np.zeros(len(bones)), np.full(len(bones), np.pi)
        return cls(bones, offsets, joints, outward, none, none, none, none, free, free)

    @property
    def spans(self) -> list[range]:
        """The bones of each chain."""
        return [range(first, last) for first, last in pairwise(self.offsets.tolist())]

    @cached_property
    def frames(self) -> Float[np.ndarray, "chains 3 3"]:
        """Axes of the nodes of each chain at rest, as columns: along the body, downwards, outwards."""
        down = np.tile([0.0, -1.0, 0.0], (len(self.joints), 1))
        return np.stack([np.cross(down, self.outward), down, self.outward], axis=-1)

    @cached_property
    def depths(self) -> Int[np.ndarray, " points"]:
        """Number of bones between each bone and the root of its chain; 0 for the root."""
        return np.concatenate([np.arange(len(span)) for span in self.spans])

    @property
    def tilts(self) -> Float[np.ndarray, " points"]:
        """Angle by which the middle of each limit lies outwards from the bone at rest [rad]."""
        return np.maximum(OUTWARD_LIMIT - self.inward, 0.0) / 2

    @property
    def pitches(self) -> Float[np.ndarray, " points"]:
        """Largest angle inwards and outwards from the middle of each limit [rad]; pi: the bone has no limit."""
        return np.where(self.inward >= np.pi, np.pi, np.minimum(self.inward + self.tilts, np.pi))

    @property
    def yaws(self) -> Float[np.ndarray, " points"]:
        """Largest angle sideways [rad]; at most a right angle."""
        return np.minimum(self.sideways, np.pi / 2)


@dataclass(frozen=True, eq=False)
class CapsuleColliders:
    """Capsules that joints carry, at rest in the world.

    Attributes:
        joints: The joint that carries each capsule.
        starts: One end of each axis [m].
        ends: Other end of each axis [m].
        radii: Radius of each capsule [m].
        chains: The only chain that collides with each capsule; -1: all do.
    """

    joints: Int[np.ndarray, " capsules"]
    starts: Float[np.ndarray, "capsules 3"]
    ends: Float[np.ndarray, "capsules 3"]
    radii: Float[np.ndarray, " capsules"]
    chains: Int[np.ndarray, " capsules"]

    def join(self, others: "CapsuleColliders") -> "CapsuleColliders":
        """Returns these capsules, followed by others."""
        mine, theirs = ((c.joints, c.starts, c.ends, c.radii, c.chains) for c in (self, others))
        return CapsuleColliders(*map(np.concatenate, zip(mine, theirs, strict=True)))


def distances_to_axes(
    points: Float[np.ndarray, "points 3"], starts: Float[np.ndarray, "lines 3"], ends: Float[np.ndarray, "lines 3"]
) -> tuple[Float[np.ndarray, "points lines"], Float[np.ndarray, "points lines"]]:
    """Returns the distances of points to line segments [m], and the parameter of the closest point, from 0 to 1."""
    axis = ends - starts
    to = np.asarray(points, np.float64)[:, None] - starts
    fraction = np.clip((to * axis).sum(-1) / np.maximum((axis * axis).sum(-1), 1e-18), 0.0, 1.0)
    return np.linalg.norm(to - fraction[..., None] * axis, axis=-1), fraction
