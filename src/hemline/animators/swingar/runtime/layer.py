"""A graph attention layer of one frame."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from hemline.animators.swingar.graph import Graph
from hemline.animators.swingar.kernel_inputs import LayerInputs, LayerMemory, LayerWeights, ScoreRule
from hemline.animators.swingar.layer_kernels import attend
from hemline.arrays import Float


@dataclass(frozen=True, eq=False)
class AttentionLayer:
    """A graph attention layer, see `fit.layers.GatLn`."""

    weights: Float[np.ndarray, "heads ins outs"]
    """Weights of the features."""
    extra_weights: Float[np.ndarray, "heads extra outs"]
    """Weights of the further features."""
    vectors: Float[np.ndarray, "heads 2 outs"]
    """Vectors of the scores."""
    groups: int
    """Number of results; the heads of one are averaged."""
    alpha: float | None
    """Scale of the scores; None if scores are not normalised."""

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray], name: str, alpha: float | None, groups: int | None = None) -> Self:
        """Takes the layer of a name from all arrays."""
        weights, extra, vectors = (arrays[f"{name}.{each}"] for each in ("weights", "extra_weights", "vectors"))
        return cls(weights, extra, vectors, groups or len(weights), alpha)

    @cached_property
    def kernel_weights(self) -> LayerWeights:
        """The weights as kernels take them."""
        return LayerWeights(self.weights, self.extra_weights, self.vectors)

    @cached_property
    def rule(self) -> ScoreRule:
        """How scores become attention, as kernels take it."""
        return ScoreRule(0.0 if self.alpha is None else self.alpha, self.alpha is not None)

    def __call__(
        self,
        graph: Graph,
        x: Float[np.ndarray, "_heads verts ins"],
        scale: Float[np.ndarray, " ins"] | None = None,
        extra: Float[np.ndarray, "verts extra"] | None = None,
    ) -> Float[np.ndarray, "groups verts outs"]:
        """Applies the layer to the features of all vertices [1].

        Args:
            graph: Graph of the garment.
            x: Features; one set for all heads, or one for each head.
            scale: Factors of the features; None for 1.
            extra: Further features; None for none.
        """
        scale = np.zeros(0, np.float32) if scale is None else scale
        count, width = x.shape[1], self.weights.shape[2]
        extra = np.zeros((count, 0), np.float32) if extra is None else extra
        slabs = np.empty((self.groups, 1, count, width), np.float32)
        attention = np.empty((self.groups, 1, len(graph.ring)), np.float32)
        out = np.empty((1, self.groups, count, width), np.float32)
        inputs = LayerInputs(x[None], scale[None], extra[None])
        attend(graph.rings, inputs, self.kernel_weights, self.rule, False, LayerMemory(slabs, attention), out)
        return out[0]
