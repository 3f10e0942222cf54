"""Skin weights of a close-fitting garment, and offsets of a draped garment from the skinned one."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np

from hemline.animators.soft_weights import soft_weights
from hemline.arrays import Faces, Float, Int, Transforms, Vertices
from hemline.meshes import edges
from hemline.motions.motion import JOINT_COUNT
from hemline.motions.quaternions import from_matrix, normalise, to_matrix

if TYPE_CHECKING:
    from hemline.bodies.body import PosedBody

INFLUENCES = 6
"""Most bones that a vertex follows."""

SMOOTHING = 4
"""Number of smoothing passes over the weights, each of which averages a vertex with its neighbours."""


@dataclass(frozen=True)
class Binding:
    """Skin weights of a garment, taken from the body under it.

    Attributes:
        indices: Bones of each vertex, int32.
        weights: Weights of these bones, float32; each row sums to 1.
        nearest: Closest body vertex of each garment vertex, int32.
    """

    indices: Int[np.ndarray, "verts influences"]
    weights: Float[np.ndarray, "verts influences"]
    nearest: Int[np.ndarray, " verts"]

    @classmethod
    def of(cls, vertices: Vertices, faces: Faces, posed: "PosedBody") -> Self:
        """Takes the weights of the body near each vertex (`soft_weights`), and smooths them over the cloth.

        With the weights of the closest body vertex alone, skinning would tear a skirt apart between the legs. Without
        smoothing it would tear neighbours apart of which one is next to an arm and the other next to the chest.

        Args:
            vertices: The garment on the body, arms and legs spread as in the T-pose [m].
            faces: Triangles of the garment.
            posed: The posed body.

        Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations",
            2021, section 3.4 (binding information). Differs: the weights are averaged and smoothed, and one binding
            serves all shapes and poses.
        """
        from scipy.sparse import coo_array
        from scipy.spatial import KDTree

        body, count = posed.shaped.body, len(vertices)
        nearest = np.asarray(KDTree(posed.vertices).query(vertices)[1], np.int32)
        dense = soft_weights(vertices, body, posed.vertices).dense().astype(np.float64)
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
        """Returns the blended skin transform of each vertex, float64."""
        return np.einsum("vk,vkij->vij", self.weights, transforms[self.indices].astype(np.float64))

    def rotations(self, transforms: Transforms) -> Float[np.ndarray, "verts 3 3"]:
        """Returns the rotation of each vertex frame, the blended quaternion of its bones, float64.

        The blended transform itself shrinks where two bones point in different directions, and its inverse then
        amplifies small offsets. A rotation does neither.
        """
        bones = from_matrix(transforms[:, :, :3].astype(np.float64))[self.indices]
        signs = np.where(np.einsum("vki,vi->vk", bones, bones[:, 0]) < 0, -1.0, 1.0)
        return to_matrix(normalise(np.einsum("vk,vki->vi", self.weights * signs, bones)))

    def offsets(
        self, transforms: Transforms, rest: Float[np.ndarray, "verts 3"], vertices: Vertices
    ) -> Float[np.ndarray, "verts 3"]:
        """Returns the offset of each world vertex from the skinned `rest`, in its rotated vertex frame [m]."""
        differences = vertices - self.skin(transforms, rest)
        return np.einsum("vji,vj->vi", self.rotations(transforms), differences)

    def skin(
        self,
        transforms: Transforms,
        rest: Float[np.ndarray, "verts 3"],
        offsets: Float[np.ndarray, "verts 3"] | None = None,
    ) -> Float[np.ndarray, "verts 3"]:
        """Skins points of the rest pose and adds offsets given in the rotated vertex frames [m], float64."""
        blended = self.matrices(transforms)
        points = np.einsum("vij,vj->vi", blended[:, :, :3], rest) + blended[:, :, 3]
        return points if offsets is None else points + np.einsum("vij,vj->vi", self.rotations(transforms), offsets)

    def fit_rest(
        self, transforms: Float[np.ndarray, "poses joints 3 4"], garments: Float[np.ndarray, "poses verts 3"]
    ) -> Float[np.ndarray, "verts 3"]:
        """Finds the garment in the rest pose that, once skinned, is closest to garments in some poses (least squares).

        Args:
            transforms: Skin transforms of each pose.
            garments: The garment in each pose, in the world [m].
        """
        left, right = np.zeros((len(self.nearest), 3, 3)), np.zeros((len(self.nearest), 3))
        for of_pose, target in zip(transforms, garments, strict=True):
            blended = self.matrices(of_pose)
            linear = blended[:, :, :3]
            left += np.einsum("vki,vkj->vij", linear, linear)
            right += np.einsum("vki,vk->vi", linear, target - blended[:, :, 3])
        return np.linalg.solve(left, right[:, :, None])[:, :, 0]

    def dense_weights(self) -> Float[np.ndarray, "verts joints"]:
        """Returns the weights of all bones, one row per vertex."""
        dense = np.zeros((len(self.weights), JOINT_COUNT))
        np.add.at(
            dense, (np.repeat(np.arange(len(dense)), self.weights.shape[1]), self.indices.ravel()), self.weights.ravel()
        )
        return dense
