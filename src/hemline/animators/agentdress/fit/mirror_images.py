"""Mirror images of settled garments, which double the training data of a symmetric garment at no cost."""

from dataclasses import replace

import numpy as np

from hemline.arrays import Int
from hemline.bodies import Body
from hemline.garments.garment import Garment
from hemline.learning.mirror import MirrorImage, is_symmetric, mirror_rotations

from .anchor_set import AnchorSet
from .material_fit import MaterialChanges


def mirror_image(garment: Garment, body: Body) -> MirrorImage | None:
    """Returns the mirror image of a garment; None if the garment or the body, in any shape, is not symmetric.

    The image is taken of the garment as made, since a settled garment may have slipped to one side.
    """
    shapes = [(), *np.eye(len(body.shapedirs))]
    if not all(is_symmetric(body.shaped(shape)) for shape in shapes):
        return None
    return MirrorImage.on(garment.vertices, garment.faces)


def add_mirror_images(anchors: AnchorSet, image: MirrorImage, *, rest_too: bool) -> AnchorSet:
    """Inserts the mirror image of each pose after it: pose p becomes 2 p, its image 2 p + 1.

    A mirrored body has the same betas.

    Args:
        anchors: The anchors.
        image: Mirror image of the garment.
        rest_too: Whether whole garments are mirrored. Otherwise only their offsets from the rest garment are, and an
            asymmetry of the rest garment, from its cut or its mesh, stays.
    """
    poses, rest = _image_poses(anchors.other_poses), anchors.rest.mean.reshape(-1, 3)
    order, shift = np.argsort(poses, kind="stable"), np.float32(rest_too) * (image.of(rest) - rest).astype(np.float32)
    return replace(
        anchors,
        rotations=_interleave(anchors.rotations, mirror_rotations(anchors.rotations)),
        offsets=_interleave(anchors.offsets, _mirror(anchors.offsets, image) + shift),
        single_rotations=_interleave(anchors.single_rotations, mirror_rotations(anchors.single_rotations)),
        single_offsets=_interleave(anchors.single_offsets, _mirror(anchors.single_offsets, image) + shift),
        other_poses=poses[order],
        other_betas=np.repeat(anchors.other_betas, 2, axis=0)[order],
        other_offsets=_interleave(anchors.other_offsets, _mirror(anchors.other_offsets, image) + shift)[order],
        groups=np.repeat(anchors.groups, 2),
    )


def add_mirrored_changes(changes: MaterialChanges, image: MirrorImage) -> MaterialChanges:
    """Inserts the mirror image of each change in another material.

    Args:
        changes: Changes in poses of anchors before `add_mirror_images`.
        image: Mirror image of the garment.
    """
    poses = _image_poses(changes.poses)
    order = np.argsort(poses, kind="stable")
    added = changes.added.reshape(len(changes.poses), -1, 3)
    return replace(
        changes,
        poses=poses[order],
        coordinates=np.repeat(changes.coordinates, 2, axis=0)[order],
        added=_interleave(added, _mirror(added, image))[order].reshape(len(poses), -1),
    )


def _image_poses(poses: Int[np.ndarray, " samples"]) -> Int[np.ndarray, " twice"]:
    return _interleave(2 * poses, 2 * poses + 1)


def _interleave(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Alternates the rows of two arrays."""
    return np.stack([one, other], axis=1).reshape(-1, *one.shape[1:])


def _mirror(vectors: np.ndarray, image: MirrorImage) -> np.ndarray:
    return image.of(vectors).astype(vectors.dtype)
