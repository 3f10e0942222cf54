"""A garment and its frames with left and right exchanged: another garment and another motion, for nothing."""

from dataclasses import replace

import numpy as np

from hemline.animators.coarse.features.mirror import VECTOR, dynamic_mirror, static_mirror
from hemline.animators.coarse.proxy_on_body import DYNAMIC_COUNT, STATIC_COUNT
from hemline.animators.swingar.graph_inputs import vertex_inputs
from hemline.learning.mirror import mirrored_transforms, swapped_joints
from hemline.motions.motion import JOINT_COUNT

from .samples import FrameBatch, GarmentSample

_TURNED = np.array([1, -1, -1], np.float32)
"""Signs of an axis-angle in a mirror."""


def mirrored_garment(garment: GarmentSample) -> GarmentSample:
    """The garment of the mirror image: the same vertices, as numbered before."""
    signs = np.concatenate([VECTOR, VECTOR, [1]]).astype(np.float32)
    faces = np.ascontiguousarray(garment.faces[:, ::-1])
    logits = np.ascontiguousarray(garment.skin_logits[:, swapped_joints()])
    return replace(garment, faces=faces, features=garment.features * signs, skin_logits=logits)


def mirrored_frames(batch: FrameBatch) -> FrameBatch:
    """The frames of the mirror image. Betas stay: each makes both sides of a body alike."""
    joints = swapped_joints()
    motion, body = batch.motion.copy(), batch.body.copy()
    for axes in (motion[..., : 3 * JOINT_COUNT], body[:, -3 * JOINT_COUNT :]):
        each = axes.reshape(*axes.shape[:-1], JOINT_COUNT, 3)
        axes[...] = (each[..., joints, :] * _TURNED).reshape(axes.shape)
    motion[..., 3 * JOINT_COUNT :] *= VECTOR
    told = None
    if batch.told is not None:
        order, signs = vertex_mirror()
        told = batch.told[..., order] * signs
    heading = batch.heading * VECTOR * VECTOR[:, None]
    return FrameBatch(
        motion,
        np.ascontiguousarray(mirrored_transforms(batch.transforms), np.float32),
        batch.joints[:, joints] * VECTOR,
        body,
        heading,
        batch.truth * VECTOR,
        told,
        None if batch.turns is None else batch.turns * np.array([1, 1, -1, -1], np.float32),
    )


def vertex_mirror() -> tuple[np.ndarray, np.ndarray]:
    """Columns of `graph_inputs.vertex_inputs` in a mirror: mirrored = told[..., order] * signs."""
    mirrors = dynamic_mirror(), static_mirror()
    # where each column of the inputs comes from is found by what becomes of numbers
    numbers = np.arange(1.0, DYNAMIC_COUNT + 1), np.arange(DYNAMIC_COUNT + 1.0, DYNAMIC_COUNT + STATIC_COUNT + 1)
    images = [each[order] * signs for each, (order, signs) in zip(numbers, mirrors, strict=True)]
    own, there = (vertex_inputs(told[None], static[None])[0] for told, static in (numbers, images))
    place = {int(value): column for column, value in enumerate(own)}
    return np.array([place[int(abs(value))] for value in there]), np.sign(there)
