"""A dressed character at rest, whose garment an engine swings itself: meshes on bones, spring chains, colliders."""

from dataclasses import dataclass

import numpy as np

from hemline.arrays import AnyFaces, AnyVertices, Float, Int, Joints
from hemline.springs import CapsuleColliders, SpringChains


@dataclass(frozen=True)
class BoundMesh:
    """A mesh that follows bones.

    Attributes:
        name: Name of the mesh.
        vertices: Positions that the bind matrices take into the frames of the bones [m].
        faces: Triangles.
        colour: sRGB from 0 to 1.
        bones: The bones of each vertex: joints of the body, then those of the chains.
        weights: Weights of those bones; each row sums to 1.
        binds: Bind matrices, from `vertices` into the frame of each bone.
    """

    name: str
    vertices: AnyVertices
    faces: AnyFaces
    colour: tuple[float, float, float]
    bones: Int[np.ndarray, "_verts 4"]
    weights: Float[np.ndarray, "_verts 4"]
    binds: Float[np.ndarray, "bones 3 4"]


@dataclass(frozen=True)
class DressedCharacter:
    """A body in a garment, in the T-pose, facing +z, soles at height 0.

    Attributes:
        name: Name of the garment.
        joint_names: Names of the body's joints.
        joints: Positions of the joints [m].
        parents: Parent of each joint, which precedes it; -1 for the root.
        meshes: Garment and body.
        chains: Chains of bones that swing.
        capsules: Colliders of the chains.
        notices: Licences, that of the body first.
    """

    name: str
    joint_names: tuple[str, ...]
    joints: Joints
    parents: Int[np.ndarray, " joints"]
    meshes: tuple[BoundMesh, ...]
    chains: SpringChains
    capsules: CapsuleColliders
    notices: tuple[str, ...]


def bone_names(character: DressedCharacter) -> list[str]:
    """Returns the names of the joints, then of the bones of the chains."""
    return [
        *character.joint_names,
        *(
            f"{character.name} {number:02d} {bone:02d}"
            for number, span in enumerate(character.chains.spans)
            for bone in range(len(span))
        ),
    ]
