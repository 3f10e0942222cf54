"""Places a motion on a body: scales the root to its legs and puts its soles on the floor."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from hemline.motions import JOINT_NAMES, Motion, Pose

from .pose_offsets import pose_offsets
from .shape import BodyShape
from .skinning import skin_points

CONTACT_PERCENT = 5
"""Percentage of a clip's frames in which a sole is on or below the floor."""

_SOLE_HEIGHT = 0.03


@dataclass(frozen=True)
class Placement:
    """Map of a clip onto a body: x -> scale x + (0, lift, 0) for the pelvis joint, in float32; rotations stay.

    Attributes:
        scale: Leg length of the body divided by that of the clip.
        lift: Height by which the scaled clip is raised, the same for all frames [m].
        leg_length: Hip to knee to ankle of the body [m].
    """

    scale: float
    lift: float
    leg_length: float

    def of(self, pose: Pose) -> Pose:
        """Returns one frame of the clip on the body, bit for bit as `of_motion` does; its `clip` is None."""
        return pose.move_to(self._transform(pose.translation))

    def of_motion(self, motion: Motion) -> Motion:
        """Returns the clip, or a part of it, on the body."""
        return replace(motion, translations=self._transform(motion.translations), leg_length=self.leg_length)

    def _transform(self, translations: Float[np.ndarray, "... 3"]) -> Float[np.ndarray, "... 3"]:
        return translations * np.float32(self.scale) - np.array([0, -self.lift, 0], dtype=np.float32)


def sole_vertices(shaped: BodyShape) -> Int[np.ndarray, " soles"]:
    """Returns the vertices of both soles, which ankles and feet move, in the lowest 3 cm of the body at rest."""
    body = shaped.body
    feet = [JOINT_NAMES.index(f"{side}_{name}") for side in ("left", "right") for name in ("ankle", "foot")]
    share = np.where(np.isin(body.weight_indices, feet), body.weights, 0).sum(axis=1)
    on_feet = share > 0.99
    if not on_feet.any():  # boots that shins move as well
        on_feet = share >= share.max() / 2
    height = shaped.vertices[:, 1]
    return np.flatnonzero(on_feet & (height < height[on_feet].min() + _SOLE_HEIGHT)).astype(np.int32)


def sole_heights(shaped: BodyShape, motion: Motion) -> Float[np.ndarray, " frames"]:
    """Returns the height of the lowest sole vertex in each frame [m]."""
    body, soles = shaped.body, sole_vertices(shaped)
    transforms, _ = shaped.transforms_of(motion.rotations, motion.translations)
    indices, weights, points = body.weight_indices[soles], body.weights[soles], shaped.vertices[soles]
    if body.posedirs is None:
        return np.array([skin_points(each, indices, weights, points)[:, 1].min() for each in transforms])
    posedirs = np.ascontiguousarray(body.posedirs[:, soles])
    offset = [points + pose_offsets(posedirs, rotations) for rotations in motion.rotations]
    heights = [skin_points(each, indices, weights, at) for each, at in zip(transforms, offset, strict=True)]
    return np.array([each[:, 1].min() for each in heights])


def placement(shaped: BodyShape, motion: Motion) -> Placement:
    """Returns the map of a motion onto a body: the root is scaled by leg length, and lifted until soles stand on y = 0.

    All frames are lifted alike, so that jumps stay jumps: by the fifth percentile of the height of the lowest sole.

    Args:
        shaped: The body.
        motion: Any clip; its translations are for legs of its `leg_length`.
    """
    scaled = Placement(shaped.leg_length / motion.leg_length, 0.0, shaped.leg_length)
    floor = np.percentile(sole_heights(shaped, scaled.of_motion(motion)), CONTACT_PERCENT)
    return replace(scaled, lift=-float(floor))


def place_motion(shaped: BodyShape, motion: Motion) -> Motion:
    """Places a motion on a body, see `placement`.

    Args:
        shaped: The body.
        motion: Any clip; its translations are for legs of its `leg_length`.
    """
    return placement(shaped, motion).of_motion(motion)
