"""The estimator as an ONNX file, for other programs."""

from pathlib import Path
from typing import Any

import numpy as np

from hemline.animators.swingar.onnx_nodes import onnx_module
from hemline.arrays import Float

from .estimator_config import JOINTS, MESHES, POSE_WIDTH, POSES
from .onnx_layers import LayerNodes
from .runtime import Garment, PlayedEstimator


def write_onnx(path: str | Path, estimator: PlayedEstimator) -> None:
    """Write one frame of the estimator, for any garment.

    Inputs are those of `frame_inputs`. Outputs: `coarse` (verts, 3), `weights` (verts, joints), `vertices` (verts, 3):
    the coarse mesh with the corrective displacement added, in metres.

    Args:
        path: The file.
        estimator: What is written; encoders of a garment stay behind, as a garment is encoded once.

    Raises:
        MissingExtra: onnx is not installed.
        BadOutput: The file cannot be written.
    """
    onnx_module()
    nodes = LayerNodes()
    made = _frame(nodes, estimator)
    outputs = {"coarse": ["verts", 3], "weights": ["verts", JOINTS], "vertices": ["verts", 3]}
    nodes.write(path, _input_shapes(estimator), outputs, made)


def frame_inputs(
    garment: Garment,
    motion: Float[np.ndarray, "poses 75"],
    lag: Float[np.ndarray, "verts lag"] | None,
    transforms: Float[np.ndarray, "joints 3 4"],
    before: Float[np.ndarray, "before verts 3"],
    joints: Float[np.ndarray, "meshes joints 3"],
    body: Float[np.ndarray, " body"],
) -> dict[str, np.ndarray]:
    """The inputs of the file by name.

    Args:
        garment: The garment, encoded; `ring` (verts, most) holds the ids of neighbours, filled up with the vertex's
            own, `mask` is 1 where there is one.
        motion: The last poses, as `PlayedEstimator.coarse` takes them.
        lag: Lag features; None where the estimator has none.
        transforms: Skinning transforms of the joints.
        before: The two coarse meshes before, the older one first [m].
        joints: Positions of the joints at all three times [m].
        body: Betas and axis-angles of the present pose.
    """
    ring, mask = garment.graph.padded
    found = {
        "ring": ring,
        "mask": mask,
        "positions": garment.positions,
        "features": garment.features,
        "shape": garment.shape,
        "logits": garment.logits,
        "motion": motion,
        "transforms": transforms,
        "before": before,
        "joints": joints,
        "body": body,
    }
    return found if lag is None else found | {"lag": lag}


def _input_shapes(estimator: PlayedEstimator) -> dict[str, list[Any]]:
    config = estimator.config
    found: dict[str, list[Any]] = {
        "ring": ["verts", "most"],
        "mask": ["verts", "most"],
        "positions": ["verts", 3],
        "features": [JOINTS, "verts", config.motion],
        "shape": [JOINTS],
        "logits": ["verts", JOINTS],
        "motion": [POSES, POSE_WIDTH],
        "transforms": [JOINTS, 3, 4],
        "before": [MESHES - 1, "verts", 3],
        "joints": [MESHES, JOINTS, 3],
        "body": [config.body],
    }
    return found | ({"lag": ["verts", config.lag]} if config.lag else {})


def _frame(n: LayerNodes, estimator: PlayedEstimator) -> dict[str, str]:
    """Add all nodes of a frame; the names of its outputs."""
    weights, layers = dict(estimator.arrays), estimator.layers
    lag = "lag" if estimator.config.lag else ""
    moved = _motion_feature(n, weights, estimator.config.motion)
    state = n.layer(layers["state"], "features", scale=moved, extra=lag)
    scores = n.add("MatMul", state, weights["weight.weight"].T)
    scores = n.add("Transpose", n.add("Squeeze", scores, n.whole(2)), perm=[1, 0])
    dynamic = n.add("Softmax", n.add("Add", n.add("Mul", scores, "shape"), "logits"), axis=-1)
    mean = n.add("ReduceMean", state, n.whole(0), keepdims=1)
    blend = n.layer(layers["blend_second"], n.layer(layers["blend_first"], mean, extra=lag))
    asked = n.linear(weights, "blend_motion", moved) if "blend_motion.weight" in weights else moved
    blend = n.add("Transpose", n.add("ReduceSum", n.add("Mul", blend, asked), n.whole(2), keepdims=0), perm=[1, 0])
    points = n.add("Add", "positions", n.add("Mul", blend, weights["blend_scale"]))
    blended = n.add("MatMul", dynamic, n.add("Reshape", "transforms", n.whole(JOINTS, 12)))
    blended = n.add("Reshape", blended, n.whole(-1, 3, 4))
    ones = n.add("Mul", n.add("Slice", points, n.whole(0), n.whole(1), n.whole(1)), 0.0)
    points = n.add("Concat", points, n.add("Add", ones, 1.0), axis=1)
    coarse = n.add("Squeeze", n.add("MatMul", blended, n.add("Unsqueeze", points, n.whole(2))), n.whole(2))
    correction = _correction(n, estimator, coarse)
    return {"coarse": coarse, "weights": dynamic, "vertices": n.add("Add", coarse, correction)}


def _motion_feature(n: LayerNodes, weights: dict[str, np.ndarray], width: int) -> str:
    """The last hidden state of an LSTM; ONNX has its gates in the order input, output, forget, cell."""
    order = np.concatenate([np.arange(width) + width * gate for gate in (0, 3, 1, 2)])
    given, kept = (weights[f"motion.weight_{each}_l0"][order][None] for each in ("ih", "hh"))
    biases = np.concatenate([weights[f"motion.bias_{each}_l0"][order] for each in ("ih", "hh")])[None]
    poses = n.add("Unsqueeze", "motion", n.whole(1))
    hidden = n.add("LSTM", poses, given, kept, biases, outputs=2, hidden_size=width)[1]
    return n.add("Reshape", hidden, n.whole(width))


def _correction(n: LayerNodes, estimator: PlayedEstimator, coarse: str) -> str:
    weights, layers = dict(estimator.arrays), estimator.layers
    meshes = n.add("Concat", "before", n.add("Unsqueeze", coarse, n.whole(0)), axis=0)
    hidden = cell = ""
    for step in range(MESHES):
        mesh = n.add("Gather", meshes, n.constant(np.array(step, np.int64)), axis=0)
        joints = n.add("Gather", "joints", n.constant(np.array(step, np.int64)), axis=0)
        apart = n.add("Sub", n.add("Unsqueeze", mesh, n.whole(1)), n.add("Unsqueeze", joints, n.whole(0)))
        far = n.add("Sqrt", n.add("ReduceSumSquare", apart, n.whole(2), keepdims=0))
        features = n.add("Unsqueeze", n.add("Concat", mesh, far, axis=1), n.whole(0))
        gates = n.layer(layers["mesh_gates"], features)
        if step:
            gates = n.add("Add", gates, n.layer(layers["hidden_gates"], n.add("Unsqueeze", hidden, n.whole(0))))
        each = [n.add("Squeeze", part, n.whole(0)) for part in n.add("Split", gates, outputs=4, num_outputs=4, axis=0)]
        if step:
            each[:3] = [n.add("Add", g, n.add("Mul", cell, weights["peepholes"][i])) for i, g in enumerate(each[:3])]
        taken, kept, shown = (n.add("Sigmoid", gate) for gate in each[:3])
        new = n.add("Add", each[3], n.add("Mul", kept, cell)) if step else each[3]
        cell = n.add("Mul", taken, n.add("Tanh", new))
        hidden = n.add("Mul", shown, n.add("Tanh", cell))
    feature = n.connected(weights, "body", "body")
    out = n.layer(layers["corrective_first"], n.add("Unsqueeze", hidden, n.whole(0)), scale=feature)
    out = n.add("Squeeze", n.layer(layers["corrective_second"], out), n.whole(0))
    return n.add("Mul", out, weights["corrective_scale"])
