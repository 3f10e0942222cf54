"""Put a motion on a body: the root scaled to its legs, its soles on the floor."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float, Int

from hemline.motions import JOINT_NAMES, Motion

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


def placed(shaped: "ShapedBody", motion: Motion) -> Motion:
    """The motion with its root scaled by leg length and lifted as a whole, so that the soles stand on y = 0.

    One offset a clip, so that jumps stay jumps: the fifth percentile over the frames of the lowest sole vertex.

    Args:
        shaped: The body.
        motion: Any clip; its `leg_length` says for which body its translations are.
    """
    scale = shaped.leg_length / motion.leg_length
    scaled = replace(motion, translations=motion.translations * np.float32(scale), leg_length=shaped.leg_length)
    floor = np.percentile(sole_heights(shaped, scaled), CONTACT_PERCENT)
    return replace(scaled, translations=scaled.translations - np.array([0, floor, 0], dtype=np.float32))
