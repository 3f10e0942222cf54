"""How a close-fitting garment hangs on the bones: skin weights of its vertices, and back to the rest pose."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np

from hemline.arrays import Faces, Float, Int, Transforms, Vertices
from hemline.meshes import edges
from hemline.motions.motion import JOINT_COUNT

if TYPE_CHECKING:
    from hemline.bodies.body import PosedBody

INFLUENCES = 6
"""Bones of a vertex, at most."""

SMOOTHING = 4
"""How often the weights of a vertex become the mean of its own and its neighbours'."""


@dataclass(frozen=True)
class Binding:
    """Skin weights of a garment, taken from the body under it.

    Attributes:
        indices: Bones of each vertex, int32.
        weights: Their weights, float32; they sum to 1.
        nearest: Vertex of the body closest to each of the garment's, int32.
    """

    indices: Int[np.ndarray, "verts influences"]
    weights: Float[np.ndarray, "verts influences"]
    nearest: Int[np.ndarray, " verts"]

    @classmethod
    def of(cls, worn: Vertices, faces: Faces, posed: "PosedBody") -> Self:
        """Weights of the closest vertex of the body, smoothed over the cloth.

        Where neighbours lie closest to an arm and to the chest, sudden weights would tear the cloth when it is skinned.

        Args:
            worn: The garment on the body, arms and legs spread as in the T-pose [m].
            faces: Its triangles.
            posed: The body.

        Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations",
            2021, section 3.4 (binding information). Differs: smoothed, and one binding for all shapes and poses, so
            that shape and pose only say what is added to it.
        """
        from scipy.sparse import coo_array
        from scipy.spatial import KDTree

        body, count = posed.shaped.body, len(worn)
        nearest = np.asarray(KDTree(posed.vertices).query(worn)[1], np.int32)
        dense = np.zeros((count, JOINT_COUNT))
        rows = np.repeat(np.arange(count), body.weights.shape[1])
        np.add.at(dense, (rows, body.weight_indices[nearest].ravel()), body.weights[nearest].ravel())
        first, second = edges(faces).T
        links = coo_array((np.ones(2 * len(first)), (np.r_[first, second], np.r_[second, first])), (count, count))
        links = links.tocsr()
        degree = np.maximum(links.sum(axis=1), 1)[:, None]
        for _ in range(SMOOTHING):
            dense = 0.5 * dense + 0.5 * (links @ dense) / degree
        indices = np.argsort(-dense, axis=1, kind="stable")[:, :INFLUENCES].astype(np.int32)
        weights = np.take_along_axis(dense, indices, axis=1)
        return cls(indices, (weights / weights.sum(axis=1, keepdims=True)).astype(np.float32), nearest)

    def matrices(self, transforms: Transforms) -> Float[np.ndarray, "verts 3 4"]:
        """The blended skin transform of each vertex."""
        return np.einsum("vk,vkij->vij", self.weights, transforms[self.indices])

    def unposed(self, transforms: Transforms, vertices: Vertices) -> Float[np.ndarray, "verts 3"]:
        """Where vertices in the world would be in the rest pose of the body: `posed` takes them back [m], float64."""
        blended = self.matrices(transforms.astype(np.float64))
        return np.linalg.solve(blended[:, :, :3], (vertices - blended[:, :, 3])[:, :, None])[:, :, 0]

    def posed(self, transforms: Transforms, points: Float[np.ndarray, "verts 3"]) -> Float[np.ndarray, "verts 3"]:
        """Points of the rest pose, carried along by the bones [m]."""
        blended = self.matrices(transforms)
        return np.einsum("vij,vj->vi", blended[:, :, :3], points) + blended[:, :, 3]

    def shares(self) -> Float[np.ndarray, "verts joints"]:
        """The weights as one row of all bones."""
        dense = np.zeros((len(self.weights), JOINT_COUNT))
        np.add.at(
            dense, (np.repeat(np.arange(len(dense)), self.weights.shape[1]), self.indices.ravel()), self.weights.ravel()
        )
        return dense
