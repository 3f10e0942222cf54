"""A fitted model of AgentDress, and what its drapes are in a mirror: `python -m ...agentdress_with_images OLD NEW`.

Kernel regressions hold what they were fitted to: their weights, times their own kernel matrix with the ridge, are their
outputs. Those and their mirror images are fitted anew. The same comes of the drapes themselves by `hemline fit`, which
learns from mirror images since.
"""

import sys
from dataclasses import replace

import numpy as np

from hemline import animators, bodies
from hemline.animators.agentdress.anchor_set import AnchorSet
from hemline.animators.agentdress.binding import Binding
from hemline.animators.agentdress.distances import axes_between, region_distances
from hemline.animators.agentdress.fit import SECOND_COLUMNS
from hemline.animators.agentdress.material_fit import MaterialChanges
from hemline.animators.agentdress.mirrored import changes_with_images, mirror_image
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.animators.agentdress.pose_fit import best_pose_fit
from hemline.animators.agentdress.pose_model import kernel
from hemline.animators.agentdress.shape_fit import fit_shapes
from hemline.animators.agentdress.shape_model import ShapeModel, widened
from hemline.animators.agentdress.shape_samples import ShapeSamples, over_shapes
from hemline.errors import BadModel
from hemline.learning.packed_basis import pack_basis
from hemline.learning.pca import deviations_of


def with_mirror_images(model: AnimatorAgentDress) -> AnimatorAgentDress:
    """The model fitted anew to what it holds and to the mirror images of that."""
    tables, figures = model.tables, model.figures
    rotations, axes = tables.rotations.astype(np.float64), tables.axes.astype(np.float64)
    apart = region_distances(axes_between(rotations, rotations), axes)
    basis, modes = tables.basis.unpacked().astype(np.float64), tables.pose_weights.shape[2]
    grams = [
        kernel(apart[:, region], model.width) + figures["kernel_ridge"] * np.eye(len(rotations))
        for region in range(len(axes))
    ]
    mean = tables.offset + (_outputs(grams, tables.pose_weights) @ basis[:modes]).reshape(len(rotations), -1, 3)
    shapes = tables.shapes
    added = _told(shapes, apart, model.shape_width, figures["shape_kernel_ridge"]) @ basis[modes:]
    body = bodies.load(model.body_name)
    anchors = AnchorSet(
        rotations=rotations[:0],
        betas=np.zeros((1, 1)),
        rest=ShapeModel(tables.rest.reshape(-1), np.zeros((2, tables.rest.size)), 1.0),
        offsets=np.zeros((0, 1, *tables.rest.shape), np.float32),
        single_rotations=rotations,
        single_offsets=mean.astype(np.float32),
        other_poses=shapes.poses.astype(int),
        other_betas=widened(shapes.betas.astype(np.float64), len(body.shapedirs)),
        other_offsets=(mean[shapes.poses] + added.reshape(len(added), -1, 3)).astype(np.float32),
        sensitivity=(np.zeros(0), np.zeros(0)),
        binding=Binding(tables.indices, tables.weights, tables.nearest),
        together=np.arange(len(rotations)),
    )
    image, materials = mirror_image(model.garment), None
    if image is None:
        raise BadModel("a garment with a mirror image", model.garment.name, "leave it as it is")
    if model.materials is not None:
        known = model.materials
        told = _told(known.samples, apart, known.width, figures["material_kernel_ridge"]) @ basis[modes:]
        changes = MaterialChanges(known.own, known.known, known.samples.poses.astype(int), known.samples.betas, told)
        materials = changes_with_images(changes, image)
    regions = tables.regions.astype(np.float64)
    pose = best_pose_fit(anchors, image, axes, regions, model.config)
    fitted = fit_shapes(pose.given, pose.distances, regions, model.config, materials)
    deviations = np.concatenate([deviations_of(pose.outputs), fitted.deviations])
    new = replace(
        tables,
        rotations=pose.rotations.astype(np.float32),
        offset=pose.mean.reshape(-1, 3).astype(np.float32),
        basis=pack_basis(np.concatenate([pose.basis, fitted.basis]), deviations, extra=SECOND_COLUMNS),
        pose_weights=pose.fit.weights.astype(np.float32),
        shapes=fitted.samples.halved(),
    )
    found = dict(figures) | dict(fitted.figures)
    found |= {
        "mirrored_poses": float(len(rotations)),
        "kernel_width": pose.fit.width,
        "kernel_ridge": pose.fit.ridge,
        "pose_left_out_mm": pose.left_out_mm,
        "error_to_expect_mm": pose.left_out_mm + figures["shape_left_out_mm"],
    }
    return replace(
        model,
        tables=new,
        width=pose.fit.width,
        shape_width=fitted.width,
        figures=found,
        materials=fitted.materials and fitted.materials.halved(),
    )


def _outputs(grams: list[np.ndarray], weights: np.ndarray) -> np.ndarray:
    """What regressions of all regions were fitted to: one thing, which each of them holds."""
    found = np.array([gram @ each for gram, each in zip(grams, weights.astype(np.float64), strict=True)])
    spread = float(np.std(found, axis=0).max() / np.abs(found).max())
    if spread > 0.02:
        raise BadModel("all regions were fitted to the same outputs", spread, "fit it again")
    return found.mean(axis=0)


def _told(samples: ShapeSamples, apart: np.ndarray, width: float, ridge: float) -> np.ndarray:
    """What bodies, or materials, were seen to add."""
    between = over_shapes(samples.betas, samples.betas, samples.reach)
    near = np.ix_(samples.poses, samples.poses)
    grams = [
        kernel(apart[:, region], width)[near] * between + ridge * np.eye(len(samples.poses))
        for region in range(apart.shape[1])
    ]
    return _outputs(grams, samples.weights)


if __name__ == "__main__":
    loaded = animators.load(sys.argv[1])
    assert isinstance(loaded, AnimatorAgentDress)
    with_mirror_images(loaded).save(sys.argv[2])
