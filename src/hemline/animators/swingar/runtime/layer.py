"""A graph attention layer of one frame."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self

import numpy as np

from hemline.animators.swingar.graph import Graph
from hemline.animators.swingar.layer_kernels import attend
from hemline.arrays import Float


@dataclass(frozen=True, eq=False)
class AttentionLayer:
    """The weights of a layer, see `layers.GatLn`."""

    weights: Float[np.ndarray, "heads ins outs"]
    extra_weights: Float[np.ndarray, "heads extra outs"]
    vectors: Float[np.ndarray, "heads 2 outs"]
    groups: int
    alpha: float | None

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray], name: str, alpha: float | None, groups: int | None = None) -> Self:
        """The layer of that name among all arrays."""
        weights, extra, vectors = (arrays[f"{name}.{each}"] for each in ("weights", "extra_weights", "vectors"))
        return cls(weights, extra, vectors, groups or len(weights), alpha)

    def __call__(
        self,
        graph: Graph,
        x: Float[np.ndarray, "_heads verts ins"],
        scale: Float[np.ndarray, " ins"] | None = None,
        extra: Float[np.ndarray, "verts extra"] | None = None,
    ) -> Float[np.ndarray, "groups verts outs"]:
        """Features of all vertices, one step of attention later [1].

        Args:
            graph: Who looks at whom.
            x: Features; one set for all heads, or one a head.
            scale: Factors of features; None: 1.
            extra: Further features; None: none.
        """
        scale = np.zeros(0, np.float32) if scale is None else scale
        count, width = x.shape[1], self.weights.shape[2]
        extra = np.zeros((count, 0), np.float32) if extra is None else extra
        slabs = np.empty((self.groups, 1, count, width), np.float32)
        attention = np.empty((self.groups, 1, len(graph.ring)), np.float32)
        out = np.empty((1, self.groups, count, width), np.float32)
        alpha = 0.0 if self.alpha is None else self.alpha
        given = x[None], scale[None], self.weights, extra[None], self.extra_weights, self.vectors
        attend(graph.start, graph.ring, *given, alpha, self.alpha is not None, False, slabs, attention, out)
        return out[0]
