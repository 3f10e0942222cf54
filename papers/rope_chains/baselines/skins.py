"""The standard skinnings, linear and by dual quaternions, from the bones of rope chains."""

from dataclasses import dataclass
from typing import Literal, Self

import numpy as np

from hemline.animators.ropes.bones.chains import Ropes
from hemline.arrays import Float, FramesOfVertices, Int, Nodes, Transforms, Vertices
from hemline.bodies import skin_points
from hemline.meshes import best_shares
from papers.rope_chains.baselines.bone_turns import BoneTurns

MOST_BONES = 8


@dataclass(frozen=True, eq=False)
class BoneSkin:
    """Vertices that follow the bones near them.

    Source: Jin, Omens, Geng, Teran, Kumar, Tashiro, Fedkiw, "A Neural-Network-Based Approach for Loose-Fitting
        Clothing", 2024, Section 7: the standard methods that gave no reasonable results there.
    """

    turns: BoneTurns
    bones: Int[np.ndarray, "verts near"]
    """The bones of each vertex, int32."""
    weights: Float[np.ndarray, "verts near"]
    """Their shares, float32, sum 1; the largest first."""
    blending: Literal["linear", "dual"] = "linear"

    @classmethod
    def near(cls, ropes: Ropes, rest: Vertices, rest_bones: Nodes) -> Self:
        r"""Weights $\propto 1 / d^2$ of the nearest bones at rest.

        Args:
            ropes: The bones.
            rest: The settled drape [m].
            rest_bones: The bones in it [m].
        """
        from scipy.spatial import KDTree

        distances, bones = KDTree(rest_bones).query(rest, k=min(MOST_BONES, len(rest_bones)))
        shares = 1 / np.maximum(np.asarray(distances), 1e-4) ** 2
        weights = shares / shares.sum(axis=1, keepdims=True)
        return cls(BoneTurns.of(ropes), np.asarray(bones, np.int32), weights.astype(np.float32))

    def fitted(
        self, moved: Float[np.ndarray, "frames nodes 3"], seen: FramesOfVertices, rest: Vertices, rest_bones: Nodes
    ) -> "BoneSkin":
        """The same bones with the weights that are best on simulated frames, for linear blending.

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
        weights = best_shares(square, along, self.weights.astype(np.float64))
        order = np.argsort(-weights, axis=1, kind="stable")
        bones, weights = (np.take_along_axis(each, order, axis=1) for each in (self.bones, weights))
        return BoneSkin(self.turns, bones, weights.astype(np.float32), self.blending)

    def vertices(self, moved: Float[np.ndarray, " ins"], rest: Vertices, bones: Nodes, key: Transforms) -> Vertices:
        """The garment in the world [m]; see `baseline.SkinWeights`."""
        transforms = self.turns.transforms(bones + moved.reshape(-1, 3), bones)
        # bones that say nothing hold nothing: what follows a share of 0 is not read
        points = skin_points(transforms, self.bones, self.weights, rest, blending=self.blending)
        return (points @ key[:, :3].T + key[:, 3]).astype(np.float32)
