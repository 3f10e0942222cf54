"""A garment as a skinned mesh: bones found in its motion, as engines play it."""

from dataclasses import replace

import numpy as np

from hemline.arrays import Float, FramesOfVertices, Vertices
from hemline.errors import BadInput
from hemline.meshes import RigidBones, rigid_bones, weighted

from .clip import Clip, ClipSkeleton, SkinWeights

DEFAULT_BONES = 60
"""Bones of a garment, unless asked otherwise."""
MOST_BONES = 256
"""More would not fit the one byte that engines keep for a bone's number."""
_INFLUENCES = 4
_SAMPLES, _PASSES = 1500, 3
"""Vertices that bones are looked for in, and rounds of weights and transforms."""


def skin_clip(clip: Clip, bones: int = DEFAULT_BONES) -> Clip:
    """The clip with a skin: bones whose linear blend skinning moves the garment about as it moved.

    Bones are found in a sample of the vertices; then all vertices get their weights, and the rest shape that fits
    best. Nothing is kept of how the garment was animated: any clip will do.

    Args:
        clip: What is to be skinned.
        bones: How many; more of them fit better.

    Raises:
        BadInput: More than 256 bones, none, or more than the garment has vertices for.

    Source: Le, Deng, "Smooth Skinning Decomposition with Rigid Bones", 2012. Differs: see
        `hemline.meshes.rigid_bones`; the rest shape is fitted too, by least squares.
    """
    check_bones(bones)
    frames = np.asarray(clip.vertices, np.float64)
    some = np.linspace(0, frames.shape[1] - 1, min(_SAMPLES, frames.shape[1])).astype(int)
    found = rigid_bones(frames[0, some], frames[:, some], bones, influences=_INFLUENCES, passes=_PASSES, travels=True)
    found = weighted(found, frames[0], frames, influences=_INFLUENCES, travels=True)
    rest = _best_rest(found, frames)
    errors = 1000 * np.linalg.norm(found.vertices(rest) - frames, axis=2)
    return replace(clip, skin=SkinWeights(_skeleton(found, rest, clip.name), float(errors.mean()), float(errors.max())))


def check_bones(bones: int) -> None:
    """Refuse a number of bones that no garment could have.

    Raises:
        BadInput: None, or more than 256.
    """
    if not 1 <= bones <= MOST_BONES:
        raise BadInput(f"a skin has 1 to {MOST_BONES} bones", bones, f"give such a number, or none for {DEFAULT_BONES}")


def _best_rest(bones: RigidBones, frames: FramesOfVertices) -> Vertices:
    """Rest positions with which the bones come nearest to the frames: three equations a vertex [m]."""
    square = np.zeros((frames.shape[1], 3, 3))
    along = np.zeros(square.shape[:2])
    for turns, shifts, vertices in zip(bones.turns, bones.shifts, frames, strict=True):
        matrix = (bones.weights @ turns.reshape(-1, 9)).reshape(-1, 3, 3)
        square += np.swapaxes(matrix, 1, 2) @ matrix
        along += np.einsum("vij,vi->vj", matrix, vertices - bones.weights @ shifts)
    near = 1e-6 * len(frames) * np.eye(3)  # where turned bones cancel out, near the first frame
    return np.linalg.solve(square + near, (along + frames[0] @ near)[..., None])[..., 0]


def _skeleton(bones: RigidBones, rest: Vertices, name: str) -> ClipSkeleton:
    """Each bone a root, at the middle of the vertices that follow it."""
    shares = bones.weights + 1e-9  # a bone that nothing follows is in the middle of all
    joints = (shares.T @ rest) / shares.sum(0)[:, None]
    indices = np.argsort(-bones.weights, axis=1, kind="stable")[:, :_INFLUENCES]
    weights: Float[np.ndarray, "verts influences"] = np.take_along_axis(bones.weights, indices, axis=1)
    return ClipSkeleton(
        joints=joints.astype(np.float32),
        parents=np.full(len(joints), -1, np.int32),
        transforms=np.concatenate([bones.turns, bones.shifts[..., None]], axis=-1),
        vertices=rest.astype(np.float32),
        weight_indices=indices.astype(np.int32),
        weights=weights.astype(np.float32),
        names=tuple(f"{name} {bone:02d}" for bone in range(len(joints))),
    )
