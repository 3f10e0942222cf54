"""A fitted model of AgentDress of version 4 as one of version 5: `python -m ...agentdress_of_version_4 OLD NEW`.

Version 5 compares bodies by how their skin differs under the garment (`shape_scale`). A kernel regression holds what it
was fitted to: its weights, times its own kernel matrix with the ridge, are its outputs. What shapes add is fitted anew
to those. Where regions were not fitted to the same outputs (models that were made of version 3), betas go on counting
alike. The same comes of the drapes themselves by `hemline fit`.
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from hemline import bodies
from hemline.animators.agentdress.distances import axes_between, region_distances
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.animators.agentdress.pose_model import kernel
from hemline.animators.agentdress.shape_distance import shape_scale
from hemline.animators.agentdress.shape_kernel import ShapeChanges, best_shape_kernel
from hemline.animators.agentdress.shape_model import widened
from hemline.animators.agentdress.shape_samples import ShapeSamples, over_shapes
from hemline.errors import BadModel
from hemline.files.tensors import read_tensors


def of_version_4(path: Path) -> AnimatorAgentDress:
    """The same model, betas alike."""
    arrays, metadata = read_tensors(path, "model", error=BadModel)
    for part in ("tables.shapes", "materials"):
        if f"{part}.betas" in arrays:
            arrays[f"{part}.scale"] = np.eye(arrays[f"{part}.betas"].shape[1], dtype=np.float32)
    metadata["agentdress"]["version"] = 5
    return AnimatorAgentDress.of(arrays, metadata)


def rescaled(model: AnimatorAgentDress) -> AnimatorAgentDress:
    """With what shapes add fitted anew, bodies compared by their skin."""
    tables, figures, shapes = model.tables, model.figures, model.tables.shapes
    rotations, axes = tables.rotations.astype(np.float64), tables.axes.astype(np.float64)
    apart = region_distances(axes_between(rotations, rotations), axes)
    near, between = np.ix_(shapes.poses, shapes.poses), over_shapes(shapes.betas, shapes.betas, shapes.reach)
    ridge = figures["shape_kernel_ridge"] * np.eye(len(shapes.poses))
    held = [
        (kernel(apart[:, region], model.shape_width)[near] * between + ridge) @ weights.astype(np.float64)
        for region, weights in enumerate(shapes.weights)
    ]
    outputs = np.mean(held, axis=0)
    if np.std(held, axis=0).max() > 0.02 * np.abs(held).max():
        return model
    body = bodies.load(model.body_name)
    scale = shape_scale(body.shaped(model.garment.body_betas), tables.nearest)
    known = widened(shapes.betas.astype(np.float64), len(scale))
    images = figures.get("mirrored_poses", 0) > 0
    given = ShapeChanges(shapes.poses.astype(int), known @ scale, outputs, shapes.poses // (2 if images else 1))
    basis, regions = tables.basis.unpacked().astype(np.float64), tables.regions.astype(np.float64)
    found, missed_mm = best_shape_kernel(apart, given, basis[tables.pose_weights.shape[2] :], regions)
    new = ShapeSamples(
        shapes.poses, known.astype(np.float32), found.weights.astype(np.float32), scale.astype(np.float32)
    )
    told = {
        "shape_kernel_width": found.width,
        "shape_kernel_ridge": found.ridge,
        "shape_change_left_out_mm": missed_mm,
    }
    return replace(
        model,
        tables=replace(tables, shapes=new.halved()),
        shape_width=found.width,
        figures=dict(figures) | told,
    )


if __name__ == "__main__":
    rescaled(of_version_4(Path(sys.argv[1]))).save(Path(sys.argv[2]))
