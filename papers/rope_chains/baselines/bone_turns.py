"""Rotations of bones, computed from the positions of their neighbours."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from hemline.animators.ropes.bones.chains import Ropes
from hemline.arrays import Float, Int, Nodes

DAMPING = 1e-4
"""Weight of the identity where neighbours do not determine the rotation, relative to their moment."""


@dataclass(frozen=True, eq=False)
class BoneTurns:
    """The neighbours of each bone: the ones above and below on its chain, and those to both sides."""

    links: Int[np.ndarray, "links 2"]
    """Pairs of a bone and a neighbour, in both orders."""

    @classmethod
    def of(cls, ropes: Ropes) -> Self:
        """Finds the neighbours in a garment's ropes."""
        parents, pairs = ropes.parents, ropes.chains.pairs
        free = np.flatnonzero(parents >= 0)
        above = parents[pairs]
        roots = above[(parents[above] < 0).all(axis=1)]
        one_way = np.concatenate([np.stack([free, parents[free]], axis=1), pairs, roots])
        return cls(np.concatenate([one_way, one_way[:, ::-1]]))

    def transforms(self, now: Nodes, rest: Nodes) -> Float[np.ndarray, "nodes 3 4"]:
        r"""Returns the rigid motion of each bone and its neighbours from rest: $x' = R_i (x - r_i) + x_i$, float32.

        $R_i$ is the rotation nearest to $\sum_j (x_j - x_i)(r_j - r_i)^T$ over the neighbours $j$; bones without
        neighbours are not rotated.

        Source: Kabsch, "A Solution for the Best Rotation to Relate Two Sets of Vectors", 1976.
        """
        a, b = self.links.T
        moments = np.zeros((len(rest), 3, 3))
        np.add.at(moments, a, np.einsum("la,lb->lab", now[b] - now[a], rest[b] - rest[a]))
        size = np.trace(moments @ np.swapaxes(moments, 1, 2), axis1=1, axis2=2) ** 0.5
        moments += (DAMPING * np.maximum(size, 1e-12))[:, None, None] * np.eye(3)
        u, _, vt = np.linalg.svd(moments)
        u[:, :, 2] *= np.sign(np.linalg.det(u @ vt))[:, None]
        turns = u @ vt
        shifts = now - np.einsum("nab,nb->na", turns, rest)
        return np.concatenate([turns, shifts[:, :, None]], axis=2).astype(np.float32)
