"""Layers of the estimator as nodes of ONNX: any number of neighbours."""

import numpy as np

from hemline.animators.swingar.onnx_nodes import Nodes

from .layer_kernels import SLOPE, TINY
from .runtime.layer import Layer

FAR = -1e9
"""Added to scores of places in a ring that hold no neighbour."""


class LayerNodes(Nodes):
    """Nodes, and whole layers of them."""

    def layer(self, layer: Layer, x: str, *, scale: str = "", extra: str = "") -> str:
        """Graph attention, see `layers.GatLn`; `x` (heads or 1, verts, ins), the result (groups, verts, outs)."""
        x = self.add("Mul", x, scale) if scale else x
        projected = self.add("MatMul", x, layer.weights)
        if extra and layer.extra_weights.shape[1]:
            more = self.add("MatMul", self.add("Unsqueeze", extra, self.whole(0)), layer.extra_weights)
            projected = self.add("Add", projected, more)
        halves = self.add("MatMul", projected, layer.vectors.transpose(0, 2, 1))
        looks = self.add("Slice", halves, self.whole(0), self.whole(1), self.whole(2))
        looked_at = self.add(
            "Squeeze", self.add("Slice", halves, self.whole(1), self.whole(2), self.whole(2)), self.whole(2)
        )
        scores = self.add("Add", looks, self.add("Gather", looked_at, "ring", axis=1))
        if layer.alpha is not None:
            scores = self.add("Mul", self._normalised(layer, projected, scores), float(layer.alpha))
        scores = self.add("LeakyRelu", scores, alpha=float(SLOPE))
        gaps = self.add("Mul", self.add("Sub", 1.0, "mask"), FAR)
        attention = self.add("Unsqueeze", self.add("Softmax", self.add("Add", scores, gaps), axis=-1), self.whole(2))
        gathered = self.add(
            "Squeeze", self.add("MatMul", attention, self.add("Gather", projected, "ring", axis=1)), self.whole(2)
        )
        heads, _, width = layer.weights.shape
        apart = self.add("Reshape", gathered, self.whole(layer.groups, heads // layer.groups, -1, width))
        return self.add("Tanh", self.add("ReduceMean", apart, self.whole(1), keepdims=0))

    def _normalised(self, layer: Layer, projected: str, scores: str) -> str:
        squares = self.add("ReduceSumSquare", projected, self.whole(2), keepdims=0)
        most = self.add("ReduceMax", self.add("Gather", squares, "ring", axis=1), self.whole(2), keepdims=0)
        length = np.sqrt(np.square(layer.vectors).sum((1, 2)))[:, None]
        bound = self.add("Mul", self.add("Sqrt", self.add("Add", most, squares)), length)
        own = self.add("ReduceSumSquare", self.add("Mul", scores, "mask"), self.whole(2), keepdims=0)
        divisor = self.add("Max", self.add("Sqrt", own), bound, float(TINY))
        return self.add("Div", scores, self.add("Unsqueeze", divisor, self.whole(2)))

    def connected(self, weights: dict[str, np.ndarray], name: str, value: str) -> str:
        """Three fully connected layers, rectified between them."""
        for i in (0, 2, 4):
            value = self.linear(weights, f"{name}.{i}", self.add("Relu", value) if i else value)
        return value

    def linear(self, weights: dict[str, np.ndarray], name: str, value: str) -> str:
        """One fully connected layer."""
        return self.add("Add", self.add("MatMul", value, weights[f"{name}.weight"].T), weights[f"{name}.bias"])
