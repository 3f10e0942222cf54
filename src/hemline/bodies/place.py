"""Put a motion on a body: the root scaled to its legs, its soles on the floor."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from hemline.motions import JOINT_NAMES, Motion, Pose

from .pose_offsets import pose_offsets
from .shape import BodyShape
from .skinning import skin_points

CONTACT_PERCENT = 5
"""The sole is on the floor in at least this share of a clip's frames."""

_SOLE_HEIGHT = 0.03


@dataclass(frozen=True)
class Placement:
    """How a clip is put on a body: x -> scale x + (0, lift, 0) for the pelvis joint, in float32; rotations stay.

    Attributes:
        scale: Length of the body's legs over that of the legs that the clip's translations are for.
        lift: What the scaled clip is raised by, the same for all its frames [m].
        leg_length: Hip to knee to ankle of the body [m].
    """

    scale: float
    lift: float
    leg_length: float

    def of(self, pose: Pose) -> Pose:
        """One frame of the clip on the body: bit for bit that frame of `of_motion`, of no clip any more."""
        return pose.placed_at(self._moved(pose.translation))

    def of_motion(self, motion: Motion) -> Motion:
        """The clip, or a stretch of it, on the body."""
        return replace(motion, translations=self._moved(motion.translations), leg_length=self.leg_length)

    def _moved(self, translations: Float[np.ndarray, "... 3"]) -> Float[np.ndarray, "... 3"]:
        return translations * np.float32(self.scale) - np.array([0, -self.lift, 0], dtype=np.float32)


def sole_vertices(shaped: BodyShape) -> Int[np.ndarray, " soles"]:
    """Vertices of both soles: moved by ankles and feet, in the lowest 3 cm of the body at rest."""
    body = shaped.body
    feet = [JOINT_NAMES.index(f"{side}_{name}") for side in ("left", "right") for name in ("ankle", "foot")]
    held = np.where(np.isin(body.weight_indices, feet), body.weights, 0).sum(axis=1) > 0.99
    height = shaped.vertices[:, 1]
    return np.flatnonzero(held & (height < height[held].min() + _SOLE_HEIGHT)).astype(np.int32)


def sole_heights(shaped: BodyShape, motion: Motion) -> Float[np.ndarray, " frames"]:
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


def placement(shaped: BodyShape, motion: Motion) -> Placement:
    """How a motion is put on a body: the root scaled by leg length, and lifted so that the soles stand on y = 0.

    One offset a clip, so that jumps stay jumps: the fifth percentile over the frames of the lowest sole vertex.

    Args:
        shaped: The body.
        motion: Any clip; its `leg_length` says for which body its translations are.
    """
    scaled = Placement(shaped.leg_length / motion.leg_length, 0.0, shaped.leg_length)
    floor = np.percentile(sole_heights(shaped, scaled.of_motion(motion)), CONTACT_PERCENT)
    return replace(scaled, lift=-float(floor))


def placed(shaped: BodyShape, motion: Motion) -> Motion:
    """The motion put on a body as `placement` says.

    Args:
        shaped: The body.
        motion: Any clip; its `leg_length` says for which body its translations are.
    """
    return placement(shaped, motion).of_motion(motion)
