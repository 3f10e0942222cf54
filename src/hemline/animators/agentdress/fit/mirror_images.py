"""Settled garments a second time, left and right exchanged: twice the drapes of a symmetric garment for nothing."""

from dataclasses import replace

import numpy as np

from hemline import bodies
from hemline.arrays import Int
from hemline.garments.garment import Garment
from hemline.learning.mirror import MirrorImage, is_symmetric, mirrored_rotations

from .anchor_set import AnchorSet
from .material_fit import MaterialChanges


def mirror_image(garment: Garment) -> MirrorImage | None:
    """Of a garment as it was made; None where it, or the body of one of its shapes, is not symmetric.

    As it was made, and not as it settled, where it may have slipped to one side.
    """
    body = bodies.load(garment.body_name)
    shapes = [(), *np.eye(len(body.shapedirs))]
    if not all(is_symmetric(body.shaped(shape)) for shape in shapes):
        return None
    return MirrorImage.on(garment.vertices, garment.faces)


def add_mirror_images(anchors: AnchorSet, image: MirrorImage, *, rest_too: bool) -> AnchorSet:
    """Each pose followed by its mirror image: that of pose p, now 2 p, is 2 p + 1.

    A body in a mirror has the same betas.

    Args:
        anchors: As they were settled.
        image: Of the garment.
        rest_too: Whether garments are mirrored as they lie. Else it is how they lie beside their rest: what that, by
            its cut or its mesh, has of its own on either side stays there.
    """
    poses, rest = _image_poses(anchors.other_poses), anchors.rest.mean.reshape(-1, 3)
    order, aside = np.argsort(poses, kind="stable"), np.float32(rest_too) * (image.of(rest) - rest).astype(np.float32)
    return replace(
        anchors,
        rotations=_interleave(anchors.rotations, mirrored_rotations(anchors.rotations)),
        offsets=_interleave(anchors.offsets, _mirror(anchors.offsets, image) + aside),
        single_rotations=_interleave(anchors.single_rotations, mirrored_rotations(anchors.single_rotations)),
        single_offsets=_interleave(anchors.single_offsets, _mirror(anchors.single_offsets, image) + aside),
        other_poses=poses[order],
        other_betas=np.repeat(anchors.other_betas, 2, axis=0)[order],
        other_offsets=_interleave(anchors.other_offsets, _mirror(anchors.other_offsets, image) + aside)[order],
        together=np.repeat(anchors.groups, 2),
    )


def add_mirrored_changes(changes: MaterialChanges, image: MirrorImage) -> MaterialChanges:
    """The same of what other materials change.

    Args:
        changes: In poses of anchors before `add_mirror_images`.
        image: Of the garment.
    """
    poses = _image_poses(changes.poses)
    order = np.argsort(poses, kind="stable")
    added = changes.added.reshape(len(changes.poses), -1, 3)
    return replace(
        changes,
        poses=poses[order],
        where=np.repeat(changes.coordinates, 2, axis=0)[order],
        added=_interleave(added, _mirror(added, image))[order].reshape(len(poses), -1),
    )


def _image_poses(poses: Int[np.ndarray, " samples"]) -> Int[np.ndarray, " twice"]:
    return _interleave(2 * poses, 2 * poses + 1)


def _interleave(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Rows of both in turn."""
    return np.stack([one, other], axis=1).reshape(-1, *one.shape[1:])


def _mirror(vectors: np.ndarray, image: MirrorImage) -> np.ndarray:
    return image.of(vectors).astype(vectors.dtype)
