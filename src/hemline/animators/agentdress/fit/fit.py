"""From settled garments to a model: shape models of all anchors, the pose model, one basis for both."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hemline import bodies
from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.distances import axes_between, axis_weights, region_distances
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.animators.agentdress.tables import Tables
from hemline.animators.agentdress.garment_kernels import NO_CLEARANCE
from hemline.animators.base import Progress
from hemline.animators.terms import garment_terms
from hemline.arrays import Float
from hemline.bodies.body import ShapedBody
from hemline.datasets import Dataset
from hemline.datasets.take import take_metadata
from hemline.errors import BadDataset, BadInput
from hemline.garments.garment import Garment
from hemline.learning.packed_basis import pack_basis
from hemline.learning.pca import deviations_of
from hemline.motions.terms import as_stated

from .anchor_set import AnchorSet
from .material_fit import MaterialChanges
from .mirror_images import add_mirrored_changes, mirror_image
from .pose_fit import best_pose_fit
from .regions import region_weights
from .rigged_anchors import RiggedAnchors, rows_with_derivatives
from .rigged_model import with_rigging
from .shape_distance import shape_scale
from .shape_figures import shape_figures
from .shape_fit import fit_shapes
from .suitability import fit_quality, warn_of_poor_fit

SECOND_COLUMNS = 16
"""Modes of the basis with a second column of 8 bits: those whose rounding would show most."""

SENSITIVITY_POWER = 0.75
"""Of the sensitivities, squared and summed, in distances between poses."""

LEAST_DISTANCE = 1e-9
"""Anchors that are nearer than this, squared, are in one pose, as far as a region is concerned."""


def fit(
    dataset: Dataset,
    config: AgentDressConfig | None = None,
    *,
    materials: Sequence[Dataset] = (),
    progress: Progress | None = None,
) -> AnimatorAgentDress:
    """Fit AgentDress to the anchors of a dataset.

    Args:
        dataset: What `hemline drape --anchors` made.
        config: Options.
        materials: The same garment of other materials, in some of the poses: what `hemline drape --poses-of` made.
        progress: Called with stage, steps done and steps in all.

    Returns:
        The animator.

    Raises:
        BadBody: The body that the garment was made on is not there.
        BadDataset: The dataset holds no such anchors, or none with derivatives where rigging is asked for, or its
            anchors were made on another body; or as `MaterialChanges.of`.
        BadInput: Options that know nothing of materials, with such.

    Warns:
        HemlineWarning: The garment is too loose or too tight for the method, or the anchors are few; with the error to
            expect.

    Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations", 2021.
        Differs: see `README.md`.
    """
    config, tell = config or AgentDressConfig(), progress or (lambda stage, done, total: None)
    tell("anchors", 0, 1)
    if materials and not config.by_kernels:
        cure = "leave --pose-model and --shape-model out, or name one dataset"
        raise BadInput("materials are told by kernels alone", f"{config.pose_model}, {config.shape_model}", cure)
    for each in (dataset, *materials):
        _check_body(each)
    if materials and all(not np.any(row.betas) for row in dataset.anchors()):
        cure = "name the one that 'hemline drape --anchors' made first, those of other materials after it"
        raise BadDataset(
            "the first of several datasets has the anchors, on bodies of many shapes", dataset.folder, cure
        )
    rows = rows_with_derivatives(dataset) if config.pose_model == "sor" else []
    anchors = AnchorSet.of(dataset, config)
    tell("anchors", 1, 1)
    others = MaterialChanges.of(dataset.garment, anchors, materials) if materials else None
    model = fit_anchors(dataset.garment, anchors, config, materials=others, progress=tell)
    if rows:
        model = with_rigging(RiggedAnchors.search(dataset, rows, model, anchors, tell))
    figures = dict(model.figures) | fit_quality(dataset, anchors)
    warn_of_poor_fit(dataset.garment.name, figures, config)
    return replace(model, figures=figures, licences=_licences((dataset, *materials)))


def _licences(data: Sequence[Dataset]) -> tuple[str, ...]:
    """Terms of body, garment and motions, as far as the anchors tell which these are."""
    garment = data[0].garment
    motions = {take_metadata(each.path(row.name))["motion"]["licence"] for each in data for row in each.anchors()}
    return as_stated((bodies.load(garment.body_name).licence, *garment_terms(garment), *sorted(motions)))


def _check_body(dataset: Dataset) -> None:
    """Refuse anchors that were made on another body than the one that has the name now."""
    body = bodies.load(dataset.garment.body_name)
    for row in dataset.anchors():
        made_on = take_metadata(dataset.path(row.name))["inputs"].get("body", body.hash)
        if made_on != body.hash:
            raise BadDataset(
                f"anchors of {dataset.folder} were made on another body than {body.name} ({body.hash})",
                made_on,
                "put that body back, or drape into a new folder",
            )


def fit_anchors(
    garment: Garment,
    anchors: AnchorSet,
    config: AgentDressConfig,
    *,
    materials: MaterialChanges | None = None,
    scale: Float[np.ndarray, "betas betas"] | None = None,
    progress: Progress,
) -> AnimatorAgentDress:
    """Fit AgentDress to anchors that were read, with a kernel as pose model; see `fit`.

    Args:
        garment: The garment.
        anchors: How it lies in each anchor.
        config: Options.
        materials: What other materials change.
        scale: What betas are multiplied by before bodies are compared; left out: `shape_scale`.
        progress: Called with stage, steps done and steps in all.
    """
    body, binding, tell = bodies.load(garment.body_name), anchors.binding, progress
    shaped = body.shaped(garment.body_betas)
    regions = region_weights(binding)
    axes = _axes(regions, anchors.sensitivity[1], anchors.rotations)
    tell("pose model", 0, 1)
    image = mirror_image(garment) if config.mirror and config.by_kernels else None
    pose = best_pose_fit(anchors, image, axes, regions, config)
    if image is not None:
        materials = materials and add_mirrored_changes(materials, image)
    tell("pose model", 1, 1)
    tell("shapes", 0, 1)
    scale = shape_scale(shaped, binding.nearest) if scale is None else scale
    shapes = fit_shapes(pose.given, pose.distances, scale, regions, config, materials)
    tell("shapes", 1, 1)
    deviations = np.concatenate([deviations_of(pose.outputs), shapes.deviations])
    tables = Tables(
        indices=binding.indices,
        weights=binding.weights,
        nearest=binding.nearest,
        regions=regions.astype(np.float32),
        axes=axes.astype(np.float32),
        rotations=pose.rotations.astype(np.float32),
        rest=anchors.rest.mean.reshape(-1, 3).astype(np.float32),
        rest_effects=_round_to_half(anchors.rest.effects.reshape(-1, *garment.vertices.shape)),
        offset=pose.mean.reshape(-1, 3).astype(np.float32),
        basis=pack_basis(np.concatenate([pose.basis, shapes.basis]), deviations, extra=SECOND_COLUMNS),
        pose_weights=pose.fit.weights.astype(np.float32),
        shapes=shapes.samples.in_half_precision(),
        clearances=_clearances(anchors, shaped, config.clearance),
    )
    of_shapes = shape_figures(anchors, config)
    figures = (
        {
            "anchors": float(len(anchors.rotations)),
            "poses": float(len(anchors.groups)),
            "mirrored_poses": float(len(pose.rotations) - len(anchors.groups)),
            "shapes": float(len(anchors.betas)),
            "kernel_width": pose.fit.width,
            "kernel_ridge": pose.fit.ridge,
            "pose_left_out_mm": pose.leave_one_out_mm,
            "pose_left_out_skinned_mm": _mean_baseline_mm(pose.offsets),
            "pose_basis_mm": _residual_mm(pose.offsets - pose.mean, pose.basis),
            # for a pose and a shape that are both new
            "error_to_expect_mm": pose.leave_one_out_mm + of_shapes["shape_left_out_mm"],
        }
        | of_shapes
        | dict(shapes.figures)
    )
    return AnimatorAgentDress(
        garment,
        tables,
        body_name=garment.body_name,
        body_hash=body.hash,
        config=replace(config, pose_model="kernel", pose_modes=len(pose.basis), shape_modes=len(shapes.basis)),
        width=pose.fit.width,
        shape_width=shapes.width,
        figures=figures,
        licences=(body.licence,) if body.licence else (),
        fitted_betas=(float(anchors.betas.min()), float(anchors.betas.max())),
        materials=shapes.materials and shapes.materials.in_half_precision(),
    )


def _axes(
    regions: Float[np.ndarray, "verts regions"],
    sensitivity: Float[np.ndarray, "verts joints 3"],
    rotations: Float[np.ndarray, "anchors joints 4"],
) -> Float[np.ndarray, "regions axes"]:
    r"""What the axes of the joints count for in each region, scaled: the median squared distance of anchors is 1.

    Where fewer than half of them differ in a region it is their mean, and where none do nothing is scaled.

    Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations", 2021,
        Eq. 7, $Q_{g,m} = \sum_y w_{g,y} |\bar\delta_{y,m}|^2$. Differs: of the sensitivity less what the skin under the
        cloth does, which skinning adds anyway; with all of it a joint far away counts by its lever arm. And
        $Q^{3/4}$: with Q itself a few joints decide, with its root the others blur it.
    """
    influence = np.einsum("vg,vja->gja", regions, sensitivity**2) ** SENSITIVITY_POWER
    weights = axis_weights(influence)
    distances = region_distances(axes_between(rotations, rotations), weights)
    apart = distances.transpose(1, 0, 2)[:, ~np.eye(len(rotations), dtype=bool)]
    scale = np.median(apart, axis=1)
    scale = np.where(scale > LEAST_DISTANCE, scale, apart.mean(axis=1))
    return weights / np.where(scale > LEAST_DISTANCE, scale, 1.0)[:, None]


def _round_to_half(values: np.ndarray) -> np.ndarray:
    """As a model file keeps them."""
    return values.astype(np.float16).astype(np.float32)


def _mean_baseline_mm(offsets: np.ndarray) -> float:
    """What the mean of the others, skinned, misses: the baseline."""
    count = len(offsets)
    away = (offsets - offsets.mean(axis=0)) * count / (count - 1)
    return 1e3 * float(np.linalg.norm(away.reshape(count, -1, 3), axis=2).mean())


def _residual_mm(rows: np.ndarray, basis: np.ndarray) -> float:
    left = rows - (rows @ basis.T) @ basis
    return 1e3 * float(np.linalg.norm(left.reshape(len(rows), -1, 3), axis=2).mean())


def _clearances(anchors: AnchorSet, shaped: ShapedBody, most: float) -> Float[np.ndarray, " verts"]:
    r"""$d_0 = \min(h_0, \epsilon_p)$, the least over the anchors of a vertex' height over the skin, which is 0 or more.

    Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations", 2021,
        Eq. 10. Differs: one value a vertex, measured in the rest pose, where all anchors are laid side by side; with
        one an anchor, what holds cloth off in one would have to be known of the next.
    """
    nearest = anchors.binding.nearest
    if most == 0:
        return np.full(len(nearest), NO_CLEARANCE, np.float32)
    laid = anchors.rest.mean.reshape(-1, 3) + anchors.offsets[:, 0]
    height = np.einsum("avi,vi->av", laid - shaped.vertices[nearest], shaped.normals[nearest])
    return np.clip(np.percentile(height, 10, axis=0), 0.0, most).astype(np.float32)
