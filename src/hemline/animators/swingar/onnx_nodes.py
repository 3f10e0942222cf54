"""A network as nodes of ONNX, written one by one: no torch, any number of vertices."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hemline.errors import MissingExtra
from hemline.files import written_whole

OPSET = 18
WHOLE = frozenset({"ring", "cell", "near"})
"""Inputs that are numbers of vertices or of cells."""

Shapes = Mapping[str, Sequence[int | str]]
"""Names of inputs or outputs, and the length of each axis, or its name."""


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

    def write(self, path: str | Path, inputs: Shapes, outputs: Shapes, made: Mapping[str, str]) -> None:
        """Write the file, whole or not at all.

        Args:
            path: The file.
            inputs: What it is given; those in `WHOLE` are int64, all others float32.
            outputs: What it gives, float32.
            made: For each output the name of what holds it.

        Raises:
            MissingExtra: onnx is not installed.
            BadOutput: The file cannot be written.
        """
        onnx = onnx_module()
        real, whole = onnx.TensorProto.FLOAT, onnx.TensorProto.INT64
        named = [onnx.helper.make_node("Identity", [made[name]], [name]) for name in outputs]
        ins = [_described(name, whole if name in WHOLE else real, shape) for name, shape in inputs.items()]
        outs = [_described(name, real, shape) for name, shape in outputs.items()]
        graph = onnx.helper.make_graph(self.nodes + named, "swingar", ins, outs, self.constants)
        imports = [onnx.helper.make_opsetid("", OPSET)]
        model = onnx.helper.make_model(graph, opset_imports=imports, producer_name="hemline", ir_version=9)
        onnx.checker.check_model(model)
        with written_whole(path) as temporary:
            temporary.write_bytes(model.SerializeToString())


def onnx_module() -> Any:
    """onnx, imported; raises MissingExtra where it is not installed."""
    try:
        import onnx
    except ImportError as reason:
        raise MissingExtra("onnx", "onnx", "writing ONNX files") from reason
    return onnx


def _described(name: str, kind: int, shape: Sequence[int | str]) -> Any:
    return onnx_module().helper.make_tensor_value_info(name, kind, list(shape))
