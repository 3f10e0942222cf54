"""How a close-fitting garment hangs on the bones: skin weights of its vertices, and back to the rest pose."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np

from hemline.arrays import Faces, Float, Int, Transforms, Vertices
from hemline.meshes import edges
from hemline.motions.motion import JOINT_COUNT
from hemline.motions.quaternions import from_matrix, normalised, to_matrix

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
        """The blended skin transform of each vertex, float64."""
        return np.einsum("vk,vkij->vij", self.weights, transforms[self.indices].astype(np.float64))

    def rotations(self, transforms: Transforms) -> Float[np.ndarray, "verts 3 3"]:
        """How each vertex is turned: the blended quaternion of its bones, float64.

        The blended transform itself shrinks where two bones point to different sides, up to nothing; its inverse then
        makes much of little. A rotation does neither.
        """
        each = from_matrix(transforms[:, :, :3].astype(np.float64))[self.indices]
        same = np.where(np.einsum("vki,vi->vk", each, each[:, 0]) < 0, -1.0, 1.0)
        return to_matrix(normalised(np.einsum("vk,vki->vi", self.weights * same, each)))

    def offsets(
        self, transforms: Transforms, rest: Float[np.ndarray, "verts 3"], worn: Vertices
    ) -> Float[np.ndarray, "verts 3"]:
        """How far vertices in the world are from where skinning carries `rest`, each in its own turned frame [m]."""
        apart = worn - self.skin(transforms, rest)
        return np.einsum("vji,vj->vi", self.rotations(transforms), apart)

    def skin(
        self,
        transforms: Transforms,
        rest: Float[np.ndarray, "verts 3"],
        offsets: Float[np.ndarray, "verts 3"] | None = None,
    ) -> Float[np.ndarray, "verts 3"]:
        """Points of the rest pose carried along by the bones, and offsets in their turned frames added [m], float64."""
        blended = self.matrices(transforms)
        points = np.einsum("vij,vj->vi", blended[:, :, :3], rest) + blended[:, :, 3]
        return points if offsets is None else points + np.einsum("vij,vj->vi", self.rotations(transforms), offsets)

    def fit_rest(
        self, transforms: Float[np.ndarray, "poses joints 3 4"], worn: Float[np.ndarray, "poses verts 3"]
    ) -> Float[np.ndarray, "verts 3"]:
        """The garment in the rest pose which skinning carries nearest to what is worn in some poses (least squares).

        Args:
            transforms: Skin transforms of each pose.
            worn: The garment in each pose, in the world [m].
        """
        left, right = np.zeros((len(self.nearest), 3, 3)), np.zeros((len(self.nearest), 3))
        for each, there in zip(transforms, worn, strict=True):
            blended = self.matrices(each)
            turning = blended[:, :, :3]
            left += np.einsum("vki,vkj->vij", turning, turning)
            right += np.einsum("vki,vk->vi", turning, there - blended[:, :, 3])
        return np.linalg.solve(left, right[:, :, None])[:, :, 0]

    def dense_weights(self) -> Float[np.ndarray, "verts joints"]:
        """The weights as one row of all bones."""
        dense = np.zeros((len(self.weights), JOINT_COUNT))
        np.add.at(
            dense, (np.repeat(np.arange(len(dense)), self.weights.shape[1]), self.indices.ravel()), self.weights.ravel()
        )
        return dense
