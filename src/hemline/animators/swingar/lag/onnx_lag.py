"""The lag network as an ONNX file, for other programs."""

from pathlib import Path

import numpy as np

from hemline.animators.swingar.features.proxy_on_body import DYNAMIC, NEAR_CELLS, STATIC, Cells
from hemline.animators.swingar.onnx_nodes import Nodes, onnx_module
from hemline.arrays import Float

from .lag_net import LagNet


def write_onnx(path: str | Path, net: LagNet) -> None:
    """Write a frame of the network, for any garment.

    Inputs are those of `frame_inputs`. The output is `displacements` (verts, 3): from where skinning puts each vertex,
    in its turned frame, in metres.

    Args:
        path: The file.
        net: What is written. What each vertex is told is made outside of it.

    Raises:
        MissingExtra: onnx is not installed.
        BadOutput: The file cannot be written.
    """
    onnx_module()
    n = Nodes()
    h = _layer(n, net, "second", _layer(n, net, "first", n.add("Concat", "static", "told", axis=1)))
    c = _layer(n, net, "cell", _means(n, h))
    mean = n.add("Expand", n.add("ReduceMean", c, n.whole(0), keepdims=1), n.add("Shape", c))
    c = _layer(n, net, "all_cells", n.add("Concat", c, mean, axis=1))
    shares = n.add("Unsqueeze", "shares", n.whole(2))
    heard = n.add("ReduceSum", n.add("Mul", n.add("Gather", c, "near", axis=0), shares), n.whole(1), keepdims=0)
    h = _layer(n, net, "third", n.add("Concat", h, heard, axis=1))
    inputs = {
        "static": ["verts", STATIC],
        "told": ["verts", DYNAMIC],
        "cell": ["verts"],
        "near": ["verts", NEAR_CELLS],
        "shares": ["verts", NEAR_CELLS],
        "cell_sizes": ["cells"],
    }
    made = {"displacements": _linear(n, net, "fourth", h)}
    n.write(path, inputs, {"displacements": ["verts", 3]}, made)


def frame_inputs(
    static: Float[np.ndarray, "verts static"], told: Float[np.ndarray, "verts dynamic"], cells: Cells
) -> dict[str, np.ndarray]:
    """The inputs of the file by name.

    Args:
        static: What each vertex is told once, `ProxyOnBody.static`.
        told: What it is told in this frame, `Trail.told`.
        cells: Those of the garment.
    """
    sizes = np.bincount(cells.cell, minlength=cells.count).astype(np.float32)
    return {
        "static": static,
        "told": told,
        "cell": cells.cell,
        "near": cells.near,
        "shares": cells.shares,
        "cell_sizes": sizes,
    }


def _means(n: Nodes, h: str) -> str:
    """Means over the vertices of each cell."""
    sizes = n.add("Unsqueeze", "cell_sizes", n.whole(1))
    width = n.add("Slice", n.add("Shape", h), n.whole(1), n.whole(2), n.whole(0))
    shape = n.add("Concat", n.add("Shape", "cell_sizes"), width, axis=0)
    nothing = n.add("Expand", n.constant(np.zeros((1, 1), np.float32)), shape)
    sums = n.add("ScatterND", nothing, n.add("Unsqueeze", "cell", n.whole(1)), h, reduction="add")
    return n.add("Div", sums, n.add("Max", sizes, 1.0))


def _layer(n: Nodes, net: LagNet, name: str, inputs: str) -> str:
    return n.add("Relu", _linear(n, net, name, inputs))


def _linear(n: Nodes, net: LagNet, name: str, inputs: str) -> str:
    return n.add("Add", n.add("MatMul", inputs, net.weights[name]), net.biases[name])
