"""Put a motion on a body: the root scaled to its legs, its soles on the floor."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float, Int

from hemline.motions import JOINT_NAMES, Motion, Pose

from .pose_offsets import pose_offsets
from .skinning import skin_points

if TYPE_CHECKING:
    from .shaped import ShapedBody

CONTACT_PERCENT = 5
"""The sole is on the floor in at least this share of a clip's frames."""

_SOLE_HEIGHT = 0.03


def sole_vertices(shaped: "ShapedBody") -> Int[np.ndarray, " soles"]:
    """Vertices of both soles: moved by ankles and feet, in the lowest 3 cm of the body at rest."""
    body = shaped.body
    feet = [JOINT_NAMES.index(f"{side}_{name}") for side in ("left", "right") for name in ("ankle", "foot")]
    held = np.where(np.isin(body.weight_indices, feet), body.weights, 0).sum(axis=1) > 0.99
    height = shaped.vertices[:, 1]
    return np.flatnonzero(held & (height < height[held].min() + _SOLE_HEIGHT)).astype(np.int32)


def sole_heights(shaped: "ShapedBody", motion: Motion) -> Float[np.ndarray, " frames"]:
    """Height of the lowest sole vertex in each frame [m]."""
    body, soles = shaped.body, sole_vertices(shaped)
    transforms, _ = shaped.transforms_of(motion.rotations, motion.translations)
    indices, weights, points = body.weight_indices[soles], body.weights[soles], shaped.vertices[soles]
    if body.posedirs is None:
        return np.array([skin_points(each, indices, weights, points)[:, 1].min() for each in transforms])
    posedirs = np.ascontiguousarray(body.posedirs[:, soles])
    offset = [points + pose_offsets(posedirs, rotations) for rotations in motion.rotations]
    heights = [skin_points(each, indices, weights, at) for each, at in zip(transforms, offset, strict=True)]
    return np.array([each[:, 1].min() for each in heights])


@dataclass(frozen=True)
class Placement:
    """How poses of one clip are brought onto one body.

    Attributes:
        scale: Leg length of the body over that of the clip.
        lift: Height added to the scaled root [m].
        leg_length: Leg length of the body [m].
    """

    scale: float
    lift: float
    leg_length: float

    def of(self, pose: Pose) -> Pose:
        """The pose on the body: bit for bit the frame that `of_motion` gives."""
        return Pose(pose.rotations, self._moved(pose.translation))

    def of_motion(self, motion: Motion) -> Motion:
        """The motion on the body."""
        return replace(motion, translations=self._moved(motion.translations), leg_length=self.leg_length)

    def _moved(self, translations: Float[np.ndarray, "*frames 3"]) -> Float[np.ndarray, "*frames 3"]:
        return translations * np.float32(self.scale) - np.array([0, -self.lift, 0], dtype=np.float32)


def placement(shaped: "ShapedBody", motion: Motion) -> Placement:
    """The root scaled by leg length and lifted for the whole clip, so that the soles stand on y = 0.

    One offset a clip, so that jumps stay jumps: the fifth percentile over the frames of the lowest sole vertex.

    Args:
        shaped: The body.
        motion: Any clip; its `leg_length` says for which body its translations are.
    """
    scale = shaped.leg_length / motion.leg_length
    scaled = Placement(scale, 0.0, shaped.leg_length).of_motion(motion)
    floor = np.percentile(sole_heights(shaped, scaled), CONTACT_PERCENT)
    return Placement(scale, -float(floor), shaped.leg_length)


def placed(shaped: "ShapedBody", motion: Motion) -> Motion:
    """The motion on the body; see `placement`."""
    return placement(shaped, motion).of_motion(motion)
