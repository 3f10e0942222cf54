"""A model file of AgentDress of version 3 to one of version 4: `python -m ...agentdress_from_version_3 OLD NEW`.

Version 3 measured poses by the rotation vectors between joints, version 4 by the axes of their frames. A kernel
regression holds what it was fitted to: its weights, times its own kernel matrix with the ridge, are its outputs. They
are fitted anew with the distances of version 4. What shapes add is told by version 3 at its anchors, and interpolated.
"""

import sys
from pathlib import Path

import numpy as np

from hemline.animators.agentdress.distances import axes_between, region_distances
from hemline.animators.agentdress.fit import _axes, _best_kernel, _half
from hemline.animators.agentdress.model import VERSION, AnimatorAgentDress
from hemline.animators.agentdress.pose_model import kernel
from hemline.animators.agentdress.shape_samples import ShapeSamples
from hemline.animators.model_file import model_path
from hemline.errors import BadModel
from hemline.files import read_tensors
from hemline.learning.packed_basis import PackedBasis
from hemline.motions.quaternions import inverse, multiply, to_axis_angle

SHAPE_WIDTH, SHAPE_RIDGE = 2.0, 1e-2


def vectors_between(rotations: np.ndarray, influence: np.ndarray) -> np.ndarray:
    """Squared distances between poses (poses, regions, poses), as in version 3."""
    way = to_axis_angle(multiply(inverse(rotations)[None], rotations[:, None])).reshape(
        len(rotations), len(rotations), -1
    )
    return np.einsum("psm,gm->pgs", way**2, influence)


def converted(path: Path) -> AnimatorAgentDress:
    """The model of an old file."""
    arrays, metadata = read_tensors(path, "model", error=BadModel)
    old = {name.removeprefix("tables."): value for name, value in arrays.items() if name.startswith("tables.")}
    rotations, held = old["rotations"].astype(np.float64), metadata["agentdress"]
    influence, regions = old["influence"].astype(np.float64), old["regions"].astype(np.float64)
    effects = old["shape_effects"].astype(np.float64)
    anchors, ridge = effects.shape[2], metadata["figures"]["kernel_ridge"]
    axes = _axes(np.eye(len(influence)), influence.reshape(len(influence), -1, 3), rotations[:anchors])
    before, after = vectors_between(rotations, influence), region_distances(axes_between(rotations, rotations), axes)
    outputs, told = [], []
    for region in range(len(influence)):
        gram = kernel(before[:, region], held["width"]) + ridge * np.eye(len(rotations))
        outputs.append(gram @ old["pose_weights"][region])
        among = kernel(before[:anchors, region, :anchors], held["shape_width"])
        told.append(np.einsum("as,fsk->fak", among, effects[:, min(region, effects.shape[1] - 1)]))
    spread = float(np.std(outputs, axis=0).max() / np.abs(outputs).max())
    if spread > 1e-5:
        raise BadModel("all regions were fitted to the same outputs", str(path), "fit it again")
    packed = PackedBasis(*(old[f"basis.{name}"] for name in ("digits", "scales", "modes")))
    modes, basis = old["pose_weights"].shape[2], np.zeros((packed.mode_count, len(packed.digits)))
    np.add.at(basis, packed.modes, (packed.digits * packed.scales).T.astype(np.float64))
    pose, left_out_mm = _best_kernel(after, np.mean(outputs, axis=0), basis[:modes], regions)
    among = kernel(after[:anchors, :, :anchors], SHAPE_WIDTH) + SHAPE_RIDGE * np.eye(anchors)[:, None]
    again = [np.linalg.solve(among[:, region], each) for region, each in enumerate(told)]
    samples = ShapeSamples.of_effects(np.stack(again, axis=1))
    arrays["tables.axes"] = axes.astype(np.float32)
    arrays["tables.pose_weights"] = pose.weights.astype(np.float32)
    for name, value in samples.arrays().items():
        arrays[f"tables.shapes.{name}"] = _half(value).astype(value.dtype)
    for name in ("influence", "shape_effects"):
        del arrays[f"tables.{name}"]
    figures = metadata["figures"] | {
        "kernel_width": pose.width,
        "kernel_ridge": pose.ridge,
        "pose_left_out_mm": left_out_mm,
        "error_to_expect_mm": left_out_mm + metadata["figures"]["shape_left_out_mm"],
    }
    config = {name: value for name, value in metadata["config"].items() if name != "rest_ridge"}
    new = held | {"version": VERSION, "width": pose.width, "shape_width": SHAPE_WIDTH}
    return AnimatorAgentDress.of(arrays, metadata | {"agentdress": new, "config": config, "figures": figures})


if __name__ == "__main__":
    converted(model_path(sys.argv[1])).save(sys.argv[2])
