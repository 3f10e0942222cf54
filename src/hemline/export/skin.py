"""Skinning of a garment for engines: bones are fitted to its motion."""

from dataclasses import replace

import numpy as np

from hemline.arrays import Float, FramesOfVertices, Vertices
from hemline.errors import BadInput
from hemline.meshes import RigidBones, fit_weights, rigid_bones

from .clip import Clip, ClipSkeleton, SkinWeights

DEFAULT_BONES = 60
"""Default number of bones of a garment."""
MOST_BONES = 256
"""Largest number of bones, since engines store the index of a bone in one byte."""
_INFLUENCES = 4
_SAMPLES, _PASSES = 1500, 3
"""Number of vertices to which bones are fitted, and of passes over weights and transforms."""


def skin_clip(clip: Clip, bones: int = DEFAULT_BONES) -> Clip:
    """Returns a clip with a skin: bones whose linear blend skinning approximates the motion of the garment.

    Bones are fitted to a sample of the vertices; then all vertices get their weights, and the rest shape that fits
    best. Only the motion of the vertices is used, so any clip will do.

    Args:
        clip: The clip.
        bones: Number of bones; more of them fit better.

    Raises:
        BadInput: There are no bones, more than 256, or more than the garment has vertices for.

    Source: Le, Deng, "Smooth Skinning Decomposition with Rigid Bones", 2012. Differs: see
        `hemline.meshes.rigid_bones`; the rest shape is fitted too, by least squares.
    """
    check_bones(bones)
    frames = np.asarray(clip.vertices, np.float64)
    some = np.linspace(0, frames.shape[1] - 1, min(_SAMPLES, frames.shape[1])).astype(int)
    fitted = rigid_bones(frames[0, some], frames[:, some], bones, influences=_INFLUENCES, passes=_PASSES, travels=True)
    fitted = fit_weights(fitted, frames[0], frames, influences=_INFLUENCES, travels=True)
    rest = _best_rest(fitted, frames)
    errors = 1000 * np.linalg.norm(fitted.vertices(rest) - frames, axis=2)
    return replace(
        clip, skin=SkinWeights(_skeleton(fitted, rest, clip.name), float(errors.mean()), float(errors.max()))
    )


def check_bones(bones: int) -> None:
    """Refuses a number of bones that no garment can have.

    Raises:
        BadInput: It is not between 1 and 256.
    """
    if not 1 <= bones <= MOST_BONES:
        raise BadInput(f"a skin has 1 to {MOST_BONES} bones", bones, f"give such a number, or none for {DEFAULT_BONES}")


def _best_rest(bones: RigidBones, frames: FramesOfVertices) -> Vertices:
    """Returns the rest positions that fit the frames best: three equations per vertex [m]."""
    square = np.zeros((frames.shape[1], 3, 3))
    along = np.zeros(square.shape[:2])
    for turns, shifts, vertices in zip(bones.turns, bones.shifts, frames, strict=True):
        matrix = (bones.weights @ turns.reshape(-1, 9)).reshape(-1, 3, 3)
        square += np.swapaxes(matrix, 1, 2) @ matrix
        along += np.einsum("vij,vi->vj", matrix, vertices - bones.weights @ shifts)
    near = 1e-6 * len(frames) * np.eye(3)  # where rotated bones cancel out, stay near the first frame
    return np.linalg.solve(square + near, (along + frames[0] @ near)[..., None])[..., 0]


def _skeleton(bones: RigidBones, rest: Vertices, name: str) -> ClipSkeleton:
    """Returns a skeleton of roots, each in the middle of the vertices that follow it."""
    weighting = bones.weights + 1e-9  # a bone without vertices goes to the middle of all
    joints = (weighting.T @ rest) / weighting.sum(0)[:, None]
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
