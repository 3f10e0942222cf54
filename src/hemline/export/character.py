"""A person at rest whose garment an engine swings by itself: meshes on bones, chains of springs, colliders."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from hemline.arrays import AnyFaces, AnyVertices, Float, Int, Joints, Points


@dataclass(frozen=True)
class BoundMesh:
    """A mesh that follows bones.

    Attributes:
        name: What it is.
        vertices: Positions that the binds take to the bones [m].
        faces: Triangles.
        colour: sRGB from 0 to 1.
        bones: The bones of each vertex: joints of the body, then those of the chains.
        weights: Their weights; each row sums to 1.
        binds: From `vertices` into the frame of each bone.
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
    """Chains of bones that swing, one after another, each from root to tip; numbers as VRM has them.

    Attributes:
        bones: Where they are at rest [m].
        offsets: First bone of each chain, and the number of all.
        joints: The joint of the body that carries each chain.
        stiffness: Pull of the rope above each bone towards where it is at rest [m/s a frame].
        gravity: The same downwards.
        drag: Share of its velocity that each bone loses in a frame [1].
        radii: Distance that each bone keeps from colliders [m].
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
    """Round rods that joints carry; places are at rest, in the world.

    Attributes:
        joints: The joint that carries each.
        starts: One end of the axis [m].
        ends: The other [m].
        radii: Radius [m].
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
        joints: Where they are [m].
        parents: Parent of each joint, before it in order; -1 for the root.
        meshes: Garment and body.
        chains: What swings.
        capsules: What it collides with.
        notices: Licences; the first is the body's.
    """

    name: str
    joint_names: tuple[str, ...]
    joints: Joints
    parents: Int[np.ndarray, " joints"]
    meshes: tuple[BoundMesh, ...]
    chains: SpringChains
    capsules: CapsuleColliders
    notices: tuple[str, ...]
