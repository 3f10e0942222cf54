"""A frame of the estimator as nodes of ONNX, written one by one: no torch, any number of vertices and neighbours."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .layer_kernels import SLOPE, TINY
from .runtime.layer import Layer

FAR = -1e9
"""Added to scores of places in a ring that hold no neighbour."""


@dataclass(eq=False)
class Nodes:
    """Nodes and constants of a graph as they are added."""

    nodes: list[Any] = field(default_factory=list)
    constants: list[Any] = field(default_factory=list)

    def constant(self, value: Any) -> str:
        """A constant; its name. Numbers become float32, whole arrays keep their type."""
        from onnx import numpy_helper

        array = np.asarray(value, np.float32) if isinstance(value, float | int) else np.asarray(value)
        name = f"constant{len(self.constants)}"
        self.constants.append(numpy_helper.from_array(np.ascontiguousarray(array).reshape(array.shape), name))
        return name

    def add(self, kind: str, *inputs: Any, outputs: int = 1, **attributes: Any) -> Any:
        """A node; the name of its output, or names. Inputs that are no names become constants."""
        from onnx import helper

        names = [each if isinstance(each, str) else self.constant(each) for each in inputs]
        made = [f"{kind.lower()}{len(self.nodes)}_{i}" for i in range(outputs)]
        self.nodes.append(helper.make_node(kind, names, made, **attributes))
        return made[0] if outputs == 1 else made

    def whole(self, *values: int) -> str:
        """Whole numbers, as axes and shapes are given."""
        return self.constant(np.array(values, np.int64))

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
