"""Places and lengths of the bones of a garment, before ropes are made of them."""

from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hemline.animators.ropes.bones.embedding import Carriage, NodeEmbedding
from hemline.arrays import Bool, Float, FramesOfVertices, Int, Vertices

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody


class BonePlan(NamedTuple):
    """Places and lengths of the bones: first those on no chain, which the body carries, then chain by chain."""

    embedding: NodeEmbedding
    offsets: Int[np.ndarray, " chains_and_one"]
    """Index of the first bone of each chain, its root, and the number of bones."""
    lengths: Float[np.ndarray, " nodes"]
    """Length of the cloth from each bone to the one above it, 0 for those that the body carries [m]."""
    pairs: Int[np.ndarray, "pairs 2"]
    """Neighbouring bones of different chains."""
    pair_lengths: Float[np.ndarray, " pairs"]
    """Length of the cloth between them [m]."""

    def carry(self, carried: Bool[np.ndarray, " nodes"]) -> "BonePlan":
        """Returns a plan in which the body carries further bones, and chains hang from the lowest of these.

        Args:
            carried: Whether the body carries each bone; of roots and bones on no chain this is taken for granted.
        """
        loose, hanging = list(range(self.offsets[0])), []
        for first, last in pairwise(self.offsets):
            tops = [first, *(node for node in range(first + 1, last) if carried[node])]
            for top, end in pairwise([*tops, last]):
                if end - top > 1:
                    hanging.append(np.arange(top, end))
                else:
                    loose.append(top)
        order = np.concatenate([np.array(loose, np.int64), *hanging])
        offsets = len(loose) + np.concatenate([[0], np.cumsum([len(chain) for chain in hanging])])
        number = np.empty(len(order), np.int32)
        number[order] = np.arange(len(order))
        fixed = np.concatenate([np.arange(len(loose)), offsets[:-1]]).astype(np.int64)
        lengths = self.lengths[order]
        lengths[fixed] = 0.0
        pairs = number[self.pairs]
        free = ~np.isin(pairs, fixed).any(axis=1)
        embedding = NodeEmbedding(self.embedding.corners[order], self.embedding.barycentric[order])
        return BonePlan(embedding, offsets.astype(np.int32), lengths, pairs[free], self.pair_lengths[free])


class FramesInKey(NamedTuple):
    """Simulated frames relative to the key joint."""

    vertices: FramesOfVertices
    """Vertices of the garment [m]."""
    transforms: Float[np.ndarray, "frames joints 3 4"]
    """Skin transforms of the body."""


def follows_body(
    plan: BonePlan, vertices: Vertices, frames: FramesInKey, shaped: "ShapedBody", least_swing: float
) -> Bool[np.ndarray, " nodes"]:
    """Returns whether the cloth at each bone follows the body, as on a bodice or a sleeve.

    The bone that swings most never does, so that there is at least one chain.

    Args:
        plan: The bones.
        vertices: The garment at rest [m].
        frames: Simulated frames.
        shaped: The body on which it rests.
        least_swing: Mean distance from where the body would carry a bone, but for a constant offset, below which its
            cloth follows the body [m].
    """
    rest = plan.embedding.positions_on(vertices)
    away = plan.embedding.positions_on(frames.vertices) - Carriage.of(rest, shaped).positions_in(
        frames.transforms, rest
    )
    swing = np.linalg.norm(away - away.mean(axis=0), axis=2).mean(axis=0)
    swing[: plan.offsets[0]] = swing[plan.offsets[:-1]] = -1.0
    carried = swing < least_swing
    carried[swing.argmax()] = False
    return carried


def neighbours_of(offsets: Int[np.ndarray, " chains_and_one"], closed: bool) -> Int[np.ndarray, "pairs 2"]:
    """Pairs each free bone with the bone of the next chain at the same fraction of its length."""
    chains = [np.arange(first, last) for first, last in pairwise(offsets)]
    following = list(pairwise(chains))
    if closed and len(chains) > 2:
        following.append((chains[-1], chains[0]))
    pairs = [
        (one[k], two[round(k * (len(two) - 1) / (len(one) - 1))]) for one, two in following for k in range(1, len(one))
    ]
    return np.array(pairs, np.int32).reshape(-1, 2)
