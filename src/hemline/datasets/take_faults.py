"""Tests whether a take can be ground truth: no limb goes through the cloth, and the cloth is not torn."""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hemline.bodies import LIMBS, limb_bones
from hemline.garments.garment import Garment
from hemline.meshes import rest_lengths, segment_crossings, worst_edge_ratio

from .take import Take

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

THROUGH_PERCENT = 5.0
"""Percentage of the frames of a take in which a limb may be through the cloth."""
TORN_RATIO = 3.0
"""Length of an edge, over its length at rest, from which a take counts as torn."""


class TakeFaults(NamedTuple):
    """What is measured of a take, without its lead-in."""

    limbs_through: dict[str, float]
    """Frames in which a limb is through the cloth as `metrics.limbs_through` has it, by its name, if any [percent]."""
    edge_ratio: float
    """Length of the longest edge over its length at rest, see `meshes.worst_edge_ratio`."""

    @property
    def reason(self) -> str | None:
        """Says why the take is no ground truth; None if it is."""
        if self.is_through:
            limb = max(self.limbs_through, key=lambda name: self.limbs_through[name])
            return f"the {limb} is through the cloth in {self.limbs_through[limb]:.0f} % of the frames"
        if self.is_torn:
            return f"the cloth is torn: an edge is {self.edge_ratio:.1f} times as long as at rest"
        return None

    @property
    def is_through(self) -> bool:
        """Whether a limb is through the cloth for long."""
        return max(self.limbs_through.values(), default=0.0) > THROUGH_PERCENT

    @property
    def is_torn(self) -> bool:
        """Whether an edge is as long as in torn cloth only."""
        return self.edge_ratio >= TORN_RATIO


def take_faults(take: Take, garment: Garment, shaped: "ShapedBody | None") -> TakeFaults:
    """Measures a take for faults.

    A simulation has them where an arm is caught in a skirt, or a leg pulls a narrow jacket apart. A model that is
    fitted to such a take learns to show that.

    Args:
        take: The take.
        garment: Its garment.
        shaped: Its body; None if it is not known: then no limb is found to be through the cloth.
    """
    frames = take.clip_frames
    edges, lengths = rest_lengths(garment.faces, garment.rest_edges)
    counted = ~np.isin(edges, garment.pins.vertices).all(axis=1)
    ratio = float(worst_edge_ratio(take.vertices[frames], edges[counted], lengths[counted]).max(initial=1.0))
    if shaped is None or not len(frames):
        return TakeFaults({}, ratio)
    motion = take.motion
    _, joints = shaped.transforms_of(motion.rotations[frames], motion.translations[frames])
    through = np.array(
        [
            segment_crossings(bones, vertices, garment.faces) > 0
            for bones, vertices in zip(limb_bones(joints), take.vertices[frames], strict=True)
        ]
    )
    for index in np.flatnonzero(through.any(axis=1)):
        # a bone in another part of the body, where no cloth can be outside of both, does not count
        posed, limbs = shaped.posed(motion[int(frames[index])]), np.flatnonzero(through[index])
        bones = limb_bones(posed.joints)[limbs]
        through[index, limbs] = segment_crossings(bones, posed.vertices, posed.faces) == 0
    percent = 100 * through.mean(axis=0)
    return TakeFaults({LIMBS[limb]: float(percent[limb]) for limb in np.flatnonzero(percent)}, ratio)
