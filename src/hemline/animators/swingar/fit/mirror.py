"""Mirrors a garment and its frames: with left and right exchanged they are another garment and another motion."""

from dataclasses import replace

import numpy as np

from hemline.animators.coarse.features.columns import VECTOR
from hemline.animators.swingar.garment_sample import GarmentSample
from hemline.animators.swingar.graph_inputs import VERTEX
from hemline.learning.mirror import mirror_transforms, opposite_joints
from hemline.motions.motion import JOINT_COUNT

from .samples import FrameBatch

AXIS_ANGLE_SIGNS = np.array([1, -1, -1], np.float32)
"""Signs of a mirrored axis-angle."""


def mirror_garment(garment: GarmentSample) -> GarmentSample:
    """Returns the mirror image of a garment, with the same numbers of vertices."""
    signs = np.concatenate([VECTOR, VECTOR, [1]]).astype(np.float32)
    faces = np.ascontiguousarray(garment.faces[:, ::-1])
    logits = np.ascontiguousarray(garment.skin_logits[:, opposite_joints()])
    return replace(garment, faces=faces, features=garment.features * signs, skin_logits=logits)


def mirror_frames(batch: FrameBatch) -> FrameBatch:
    """Returns the mirror image of frames. Betas do not change, since bodies are symmetric."""
    joints = opposite_joints()
    motion, body = batch.motion.copy(), batch.body.copy()
    for axes in (motion[..., : 3 * JOINT_COUNT], body[:, -3 * JOINT_COUNT :]):
        each = axes.reshape(*axes.shape[:-1], JOINT_COUNT, 3)
        axes[...] = (each[..., joints, :] * AXIS_ANGLE_SIGNS).reshape(axes.shape)
    motion[..., 3 * JOINT_COUNT :] *= VECTOR
    features = None
    if batch.features is not None:
        order, signs = VERTEX.mirror()
        features = batch.features[..., order] * signs
    heading = batch.heading * VECTOR * VECTOR[:, None]
    return FrameBatch(
        motion,
        np.ascontiguousarray(mirror_transforms(batch.transforms), np.float32),
        batch.joints[:, joints] * VECTOR,
        body,
        heading,
        batch.truth * VECTOR,
        features,
        None if batch.turns is None else batch.turns * np.array([1, 1, -1, -1], np.float32),
    )
