"""The fit of AgentDress: shape models of all anchors, the pose model, and one basis for both."""

import warnings
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.distances import axes_between, axis_weights, region_distances
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.animators.agentdress.tables import Tables
from hemline.animators.base import Progress
from hemline.animators.terms import garment_terms
from hemline.arrays import Float
from hemline.datasets import Dataset
from hemline.datasets.arm_lift import arm_lift_deg
from hemline.datasets.take import take_metadata
from hemline.errors import BadDataset, BadInput, HemlineWarning
from hemline.garments.garment import Garment
from hemline.learning.packed_basis import pack_basis
from hemline.learning.pca import deviations_of
from hemline.motions.terms import as_stated

from .anchor_set import AnchorSet
from .drape_stretch import stretch_limit
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
"""Number of basis modes with a second column of 8 bits, the ones whose rounding error would be largest."""

SENSITIVITY_POWER = 0.75
"""Exponent of the summed squared sensitivities in distances between poses."""

LEAST_DISTANCE = 1e-9
"""Squared distance below which two anchors count as the same pose of a region."""


def fit(
    dataset: Dataset,
    config: AgentDressConfig | None = None,
    *,
    materials: Sequence[Dataset] = (),
    progress: Progress | None = None,
) -> AnimatorAgentDress:
    """Fits AgentDress to the anchors of a dataset.

    Args:
        dataset: A dataset made by `hemline drape --anchors`.
        config: Options.
        materials: The same garment in other materials and some of the poses, made by `hemline drape --poses-of`.
        progress: Called with the stage, steps done and total steps.

    Returns:
        The animator.

    Raises:
        BadBody: The body of the garment does not exist.
        BadDataset: The dataset holds no anchors, or none with derivatives for rigging, or anchors on another body; see
            also `MaterialChanges.of`.
        BadInput: The options do not support the given materials.

    Warns:
        HemlineWarning: The garment is too loose or too tight for the method, or there are few anchors. The warning
            names the error to expect. Or garments were settled in different ways, or by different simulators.

    Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations", 2021.
        Differs: see `README.md`.
    """
    config, report = config or AgentDressConfig(), progress or (lambda stage, done, total: None)
    report("anchors", 0, 1)
    if materials and not config.by_kernels:
        cure = "leave --pose-model and --shape-model out, or name one dataset"
        raise BadInput(
            "other materials need kernels as pose and shape model", f"{config.pose_model}, {config.shape_model}", cure
        )
    lift_deg = arm_lift_deg(dataset)
    for data in (dataset, *materials):
        _check_takes(data)
    if materials and all(not np.any(row.betas) for row in dataset.anchors()):
        cure = "name the one that 'hemline drape --anchors' made first, those of other materials after it"
        raise BadDataset(
            "the first of several datasets has the anchors, on bodies of many shapes", dataset.folder, cure
        )
    rows = rows_with_derivatives(dataset) if config.pose_model == "sor" else []
    anchors = AnchorSet.of(dataset, config)
    report("anchors", 1, 1)
    others = MaterialChanges.of(dataset.garment, anchors, materials) if materials else None
    model = fit_anchors(dataset.garment, anchors, config, materials=others, progress=report)
    if rows:
        model = with_rigging(RiggedAnchors.search(dataset, rows, model, anchors, report))
    figures = dict(model.figures) | fit_quality(dataset, anchors)
    warn_of_poor_fit(dataset.garment.name, figures, config)
    limit = stretch_limit(dataset, anchors.rest.mean.reshape(-1, 3))
    return replace(
        model,
        figures=figures,
        licences=_licences((dataset, *materials)),
        stretch_limit=limit,
        lift_deg=lift_deg,
    )


def _licences(data: Sequence[Dataset]) -> tuple[str, ...]:
    """Returns the licence terms of body, garment and motions, as far as the takes name them."""
    garment = data[0].garment
    motions = {take_metadata(each.path(row.name))["motion"]["licence"] for each in data for row in each.anchors()}
    return as_stated((data[0].body.licence, *garment_terms(garment), *sorted(motions)))


def _check_takes(dataset: Dataset) -> None:
    """Refuses anchors that were made on another body of the same name, and warns of ones settled in several ways."""
    body, ways = dataset.body, dict[str, Counter[str]]()
    for row in dataset.anchors():
        inputs = take_metadata(dataset.path(row.name))["inputs"]
        if "protocol" in inputs:
            way = f"'{inputs['protocol']}' of simulator {inputs.get('simulator', 0)}"
            ways.setdefault(inputs["protocol"].split()[0], Counter())[way] += 1
        made_on = inputs.get("body", body.hash)
        if made_on != body.hash:
            raise BadDataset(
                f"anchors of {dataset.folder} were made on another body than {body.name} ({body.hash})",
                made_on,
                "put that body back, or drape into a new folder",
            )
    for of_kind in (each for each in ways.values() if len(each) > 1):
        what = f"garments of {dataset.folder} were settled in different ways, and may contradict each other"
        got = ", ".join(f"{count} by {way}" for way, count in of_kind.most_common())
        warnings.warn(HemlineWarning(what, got, "drape them into a new folder for smaller errors"), stacklevel=3)


def fit_anchors(
    garment: Garment,
    anchors: AnchorSet,
    config: AgentDressConfig,
    *,
    materials: MaterialChanges | None = None,
    scale: Float[np.ndarray, "betas betas"] | None = None,
    progress: Progress,
) -> AnimatorAgentDress:
    """Fits AgentDress to an `AnchorSet`, with a kernel as pose model; see `fit`.

    Args:
        garment: The garment.
        anchors: Its anchors.
        config: Options.
        materials: Changes in other materials.
        scale: Matrix by which betas are multiplied before bodies are compared; `shape_scale` if omitted.
        progress: Called with the stage, steps done and total steps.
    """
    body, binding, report = anchors.body, anchors.binding, progress
    shaped = body.shaped(garment.body_betas)
    regions = region_weights(binding)
    axes = _axes(regions, anchors.sensitivity[1], anchors.rotations)
    report("pose model", 0, 1)
    image = mirror_image(garment, body) if config.mirror and config.by_kernels else None
    pose = best_pose_fit(anchors, image, axes, regions, config)
    if image is not None:
        materials = materials and add_mirrored_changes(materials, image)
    report("pose model", 1, 1)
    report("shapes", 0, 1)
    scale = shape_scale(shaped, binding.nearest) if scale is None else scale
    shapes = fit_shapes(pose.anchors, pose.distances, scale, regions, config, materials)
    report("shapes", 1, 1)
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
        shapes=shapes.samples.as_stored(),
    )
    errors_of_shapes = shape_figures(anchors, config)
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
            # for a new pose on a new shape, or on the mean one if there is no other
            "error_to_expect_mm": pose.leave_one_out_mm + errors_of_shapes.get("shape_left_out_mm", 0.0),
        }
        | errors_of_shapes
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
        materials=shapes.materials,
    )


def _axes(
    regions: Float[np.ndarray, "verts regions"],
    sensitivity: Float[np.ndarray, "verts joints 3"],
    rotations: Float[np.ndarray, "anchors joints 4"],
) -> Float[np.ndarray, "regions axes"]:
    r"""Returns the weights of the joint axes in each region, scaled to a median squared distance of 1 between anchors.

    If fewer than half of the anchors differ in a region, their mean is 1; if none do, the weights are not scaled.

    Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations", 2021,
        Eq. 7, $Q_{g,m} = \sum_y w_{g,y} |\bar\delta_{y,m}|^2$. Differs: the sensitivity is relative to the skin under
        the cloth, which skinning moves anyway; otherwise distant joints count by their lever arm. $Q^{3/4}$ replaces
        Q, with which a few joints dominate, and its root, with which all joints blur the distance.
    """
    influence = np.einsum("vg,vja->gja", regions, sensitivity**2) ** SENSITIVITY_POWER
    weights = axis_weights(influence)
    distances = region_distances(axes_between(rotations, rotations), weights)
    pairs = distances.transpose(1, 0, 2)[:, ~np.eye(len(rotations), dtype=bool)]
    scale = np.median(pairs, axis=1)
    scale = np.where(scale > LEAST_DISTANCE, scale, pairs.mean(axis=1))
    return weights / np.where(scale > LEAST_DISTANCE, scale, 1.0)[:, None]


def _round_to_half(values: np.ndarray) -> np.ndarray:
    """Rounds to half precision, as a model file stores the values."""
    return values.astype(np.float16).astype(np.float32)


def _mean_baseline_mm(offsets: np.ndarray) -> float:
    """Returns the leave-one-out error of the skinned mean garment, a baseline [mm]."""
    count = len(offsets)
    errors = (offsets - offsets.mean(axis=0)) * count / (count - 1)
    return 1e3 * float(np.linalg.norm(errors.reshape(count, -1, 3), axis=2).mean())


def _residual_mm(rows: np.ndarray, basis: np.ndarray) -> float:
    residual = rows - (rows @ basis.T) @ basis
    return 1e3 * float(np.linalg.norm(residual.reshape(len(rows), -1, 3), axis=2).mean())
