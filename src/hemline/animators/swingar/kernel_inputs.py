"""Named tuples that the kernels of graph attention take: the graph, what enters a layer, its weights, its gradients.

A layer runs over frames, heads and vertices; F features of a vertex enter it, L further ones beside them, and D leave
it. Inside the kernels the same tuples also hold one head of one frame; the axes in front are then gone.
"""

from typing import NamedTuple

import numpy as np

from hemline.arrays import Float, Int


class Rings(NamedTuple):
    """The edges of a `Graph`: the ring of vertex i is `ring[start[i]:start[i + 1]]`, itself included."""

    start: Int[np.ndarray, " verts_and_one"]
    """Index in `ring` at which the ring of each vertex begins."""
    ring: Int[np.ndarray, " edges"]
    """Vertex ids."""


class ScoreRule(NamedTuple):
    """How scores become attention."""

    alpha: float
    """Scale of the scores [1]."""
    normalised: bool
    """Whether scores are divided by a bound of theirs (GAT-LN); if not, `alpha` has no effect."""


class LayerInputs(NamedTuple):
    """What enters a layer, float32 [1]."""

    x: Float[np.ndarray, "_frames _heads verts ins"]
    """Features F; an axis of length 1 serves all frames or heads."""
    scale: Float[np.ndarray, "frames _ins"]
    """Factors of the features; of no width for 1."""
    extra: Float[np.ndarray, "frames verts extra"]
    """Further features L, perhaps none, which all heads are given."""


class LayerWeights(NamedTuple):
    """The weights of a layer, float32."""

    weights: Float[np.ndarray, "heads ins outs"]
    """Weights of the features, from F to D."""
    extra_weights: Float[np.ndarray, "heads extra outs"]
    """Weights of the further features, from L to D."""
    vectors: Float[np.ndarray, "heads 2 outs"]
    """Vectors of the scores: for a vertex as center, and as neighbour."""


class LayerMemory(NamedTuple):
    """Working memory of a layer, float32; the backward pass needs it if it is kept.

    It has an entry for each frame and head if it is kept, else for each frame and group, with one in the place of the
    heads.
    """

    slabs: Float[np.ndarray, "jobs _heads verts outs"]
    """Projected features."""
    attention: Float[np.ndarray, "jobs _heads edges"]
    """Attention of each vertex over its ring."""


class LayerGradients(NamedTuple):
    """Gradients of a layer, float32, to which the backward pass adds.

    Frames are cut into chunks, which run side by side. What serves all frames has an entry for each chunk.
    """

    x: Float[np.ndarray, "_chunks _frames _heads verts ins"]
    """Gradient of the features: one chunk if each frame has its own. Without features if it is not wanted."""
    scale: Float[np.ndarray, "frames _ins"]
    """Gradient of the factors."""
    weights: Float[np.ndarray, "chunks heads ins outs"]
    """Gradient of the weights."""
    extra_weights: Float[np.ndarray, "chunks heads extra outs"]
    """Gradient of the weights of further features."""
    vectors: Float[np.ndarray, "chunks heads 2 outs"]
    """Gradient of the vectors."""
