"""Standard skinning, linear and by dual quaternions, from the bones of rope chains."""

from dataclasses import dataclass
from typing import Literal, Self

import numpy as np

from hemline.animators.ropes.bones.chains import Ropes
from hemline.arrays import Float, FramesOfVertices, Int, Nodes, Transforms, Vertices
from hemline.bodies import skin_points
from hemline.meshes import fit_convex_weights
from papers.rope_chains.baselines.bone_turns import BoneTurns

MAX_BONES = 8
"""Bones of each vertex."""


@dataclass(frozen=True, eq=False)
class BoneSkin:
    """Skinning of vertices to the nearest bones.

    Source: Jin, Omens, Geng, Teran, Kumar, Tashiro, Fedkiw, "A Neural-Network-Based Approach for Loose-Fitting
        Clothing", 2024, Section 7: the standard methods that gave no reasonable results there.
    """

    turns: BoneTurns
    bones: Int[np.ndarray, "verts near"]
    """The bones of each vertex, int32."""
    weights: Float[np.ndarray, "verts near"]
    """Weights of those bones, float32, sum 1; the largest first."""
    blending: Literal["linear", "dual"] = "linear"

    @classmethod
    def near(cls, ropes: Ropes, rest: Vertices, rest_bones: Nodes) -> Self:
        r"""Makes a skin with weights $\propto 1 / d^2$ of the nearest bones at rest.

        Args:
            ropes: The bones.
            rest: The settled drape [m].
            rest_bones: The bones in it [m].
        """
        from scipy.spatial import KDTree

        distances, bones = KDTree(rest_bones).query(rest, k=min(MAX_BONES, len(rest_bones)))
        inverse = 1 / np.maximum(np.asarray(distances), 1e-4) ** 2
        weights = inverse / inverse.sum(axis=1, keepdims=True)
        return cls(BoneTurns.of(ropes), np.asarray(bones, np.int32), weights.astype(np.float32))

    def fit(
        self, moved: Float[np.ndarray, "frames nodes 3"], seen: FramesOfVertices, rest: Vertices, rest_bones: Nodes
    ) -> "BoneSkin":
        """Fits the weights to simulated frames by least squares, for linear blending.

        Args:
            moved: Displacements of all bones in the frame of the key joint [m].
            seen: Displacements of the vertices there [m].
            rest: The settled drape [m].
            rest_bones: The bones in it [m].
        """
        count = self.bones.shape[1]
        square, along = np.zeros((len(rest), count, count)), np.zeros((len(rest), count))
        for bones, vertices in zip(moved, seen, strict=True):
            transforms = self.turns.transforms(rest_bones + bones, rest_bones)[self.bones]
            made = np.einsum("vkab,vb->vka", transforms[..., :3], rest) + transforms[..., 3] - rest[:, None]
            square += made @ np.swapaxes(made, 1, 2)
            along += np.einsum("vka,va->vk", made, vertices)
        weights = fit_convex_weights(square, along, self.weights.astype(np.float64))
        order = np.argsort(-weights, axis=1, kind="stable")
        bones, weights = (np.take_along_axis(each, order, axis=1) for each in (self.bones, weights))
        return BoneSkin(self.turns, bones, weights.astype(np.float32), self.blending)

    def vertices(self, moved: Float[np.ndarray, " ins"], rest: Vertices, bones: Nodes, key: Transforms) -> Vertices:
        """The garment in the world [m]; see `baseline.MeshSkin`."""
        transforms = self.turns.transforms(bones + moved.reshape(-1, 3), bones)
        # weights are sorted: those after a weight of 0 are not read
        points = skin_points(transforms, self.bones, self.weights, rest, blending=self.blending)
        return (points @ key[:, :3].T + key[:, 3]).astype(np.float32)
