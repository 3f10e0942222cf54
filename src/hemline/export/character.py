"""A dressed character at rest, whose garment an engine swings itself: meshes on bones, spring chains, colliders."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from hemline.arrays import AnyFaces, AnyVertices, Float, Int, Joints, Points


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
class SpringChains:
    """Chains of bones that swing, each from root to tip, with the constants of VRM.

    Attributes:
        bones: Positions of the bones at rest [m].
        offsets: First bone of each chain, followed by the number of all bones.
        joints: The joint of the body that carries each chain.
        stiffness: Pull of each bone towards its direction at rest [m/s per frame].
        gravity: Downward pull of each bone [m/s per frame].
        drag: Fraction of its velocity that each bone loses per frame [1].
        radii: Distance of each bone from colliders [m].
    """

    bones: Points
    offsets: Int[np.ndarray, " chains_and_one"]
    joints: Int[np.ndarray, " chains"]
    stiffness: Float[np.ndarray, " points"]
    gravity: Float[np.ndarray, " points"]
    drag: Float[np.ndarray, " points"]
    radii: Float[np.ndarray, " points"]

    @property
    def spans(self) -> list[range]:
        """The bones of each chain."""
        return [range(first, last) for first, last in pairwise(self.offsets.tolist())]


@dataclass(frozen=True)
class CapsuleColliders:
    """Capsules that joints carry, at rest in the world.

    Attributes:
        joints: The joint that carries each capsule.
        starts: One end of each axis [m].
        ends: Other end of each axis [m].
        radii: Radius of each capsule [m].
    """

    joints: Int[np.ndarray, " capsules"]
    starts: Float[np.ndarray, "capsules 3"]
    ends: Float[np.ndarray, "capsules 3"]
    radii: Float[np.ndarray, " capsules"]


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
