"""From settled garments to a model: shape models of all anchors, the pose model, one basis for both."""

from dataclasses import replace

import numpy as np

from hemline import bodies
from hemline.animators.base import Progress
from hemline.arrays import Float
from hemline.datasets import Dataset

from .anchor_set import AnchorSet
from .binding import Binding
from .config import AgentDressConfig
from .distances import region_distances, turns_between
from .model import AnimatorAgentDress
from .pose_model import RIDGES, WIDTHS, PoseFit, fit_kernel
from .regions import region_weights
from .shape_model import ShapeModel
from .tables import Tables

MOST_LEFT_OUT = 64
"""Poses that a kernel is judged by; of more, as many are taken evenly."""


def fit(
    dataset: Dataset, config: AgentDressConfig | None = None, *, progress: Progress | None = None
) -> AnimatorAgentDress:
    """Fit AgentDress to the anchors of a dataset.

    Args:
        dataset: What `hemline drape --anchors` made.
        config: Options.
        progress: Called with stage, steps done and steps in all.

    Returns:
        The animator.

    Raises:
        BadDataset: The dataset holds no such anchors.

    Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations", 2021.
        Differs: see `README.md`.
    """
    config, tell = config or AgentDressConfig(), progress or (lambda stage, done, total: None)
    garment = dataset.garment
    body = bodies.load(garment.body_name)
    shaped = body.shaped(garment.body_betas)
    tell("anchors", 0, 1)
    anchors = AnchorSet.of(dataset)
    binding = anchors.binding
    tell("anchors", 1, 1)
    regions = region_weights(binding)
    influence = _influence(regions, anchors.sensitivity[1], anchors.rotations)
    models = _shape_models(anchors, config)
    count = len(anchors.rotations)
    tell("pose model", 0, 1)
    rotations = np.concatenate([anchors.rotations, anchors.single_rotations])
    garments = np.concatenate([anchors.unposed[:, 0], anchors.single]).reshape(len(rotations), -1).astype(np.float64)
    mean = garments.mean(axis=0)
    pose_basis, outputs = _basis(garments - mean, config.pose_modes)
    distances = region_distances(turns_between(rotations, rotations), influence)
    pose, left_out_mm = _best_kernel(distances, outputs, garments - mean, pose_basis, regions)
    tell("pose model", 1, 1)
    effects = np.concatenate([model.effects for model in models])
    shape_basis, coefficients = _basis(effects, config.shape_modes)
    tables = Tables(
        indices=binding.indices,
        weights=binding.weights,
        nearest=binding.nearest,
        regions=regions.astype(np.float32),
        influence=influence.astype(np.float32),
        rotations=rotations.astype(np.float32),
        mean=mean.reshape(-1, 3).astype(np.float32),
        basis=np.concatenate([pose_basis, shape_basis]).reshape(-1, *garment.vertices.shape).astype(np.float32),
        pose_weights=pose.weights.astype(np.float32),
        shape_effects=coefficients.reshape(count, -1, coefficients.shape[1]).astype(np.float32),
        clearances=_clearances(anchors, binding, shaped, config.clearance),
    )
    figures = {
        "anchors": float(count),
        "poses": float(len(rotations)),
        "shapes": float(len(anchors.betas)),
        "kernel_width": pose.width,
        "kernel_ridge": pose.ridge,
        "pose_left_out_mm": left_out_mm,
        "pose_left_out_skinned_mm": _left_out_skinned(garments),
        "pose_basis_mm": _missed_mm(garments - mean, pose_basis),
        "shape_explained_share": float(np.mean([model.explained for model in models])),
        "shape_basis_mm": _missed_mm(effects, shape_basis),
    } | _shape_figures(anchors, config)
    return AnimatorAgentDress(
        garment,
        tables,
        body_name=garment.body_name,
        body_hash=body.hash,
        config=replace(config, pose_modes=len(pose_basis), shape_modes=len(shape_basis)),
        width=pose.width,
        figures=figures,
        licences=(body.licence,) if body.licence else (),
    )


def _influence(
    regions: Float[np.ndarray, "verts regions"],
    sensitivity: Float[np.ndarray, "verts joints 3"],
    rotations: Float[np.ndarray, "anchors joints 4"],
) -> Float[np.ndarray, "regions angles"]:
    r"""$\sqrt{Q_{g,m}}$, $Q_{g,m} = \sum_y w_{g,y} |\bar\delta_{y,m}|^2$, scaled: the median distance of anchors is 1.

    Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations", 2021,
        Eq. 7. Differs: of the sensitivity less what the skin under the cloth does, which skinning adds anyway; with all
        of it a joint far away counts by its lever arm. And its root: with Q itself one or two joints decide, and the
        pose model misses more of poses that are left out.
    """
    influence = np.sqrt(np.einsum("vg,vja->gja", regions, sensitivity**2)).reshape(regions.shape[1], -1)
    distances = region_distances(turns_between(rotations, rotations), influence)
    off = ~np.eye(len(rotations), dtype=bool)
    return influence / np.median(distances.transpose(1, 0, 2)[:, off], axis=1)[:, None]


def _shape_models(anchors: AnchorSet, config: AgentDressConfig) -> list[ShapeModel]:
    betas, count = _used(anchors), len(anchors.betas)
    return [
        ShapeModel.fitted(
            each.reshape(count, -1).astype(np.float64),
            betas,
            components=config.shape_components,
            ridge=config.shape_ridge,
        )
        for each in anchors.unposed
    ]


def _used(anchors: AnchorSet) -> Float[np.ndarray, "shapes betas"]:
    """Betas that any shape has."""
    return anchors.betas[:, : int(np.flatnonzero(anchors.betas.any(axis=0)).max(initial=0)) + 1]


def _basis(rows: Float[np.ndarray, "rows entries"], modes: int) -> tuple[np.ndarray, np.ndarray]:
    """The leading directions of rows, and their coefficients."""
    left, sizes, right = np.linalg.svd(rows, full_matrices=False)
    modes = min(modes, max(1, int((sizes > 1e-9 * sizes.max(initial=1e-30)).sum())))
    return right[:modes], left[:, :modes] * sizes[:modes]


def _best_kernel(
    distances: np.ndarray, outputs: np.ndarray, garments: np.ndarray, basis: np.ndarray, regions: np.ndarray
) -> tuple[PoseFit, float]:
    """The width and ridge that miss least at poses that are left out [mm]."""
    best: tuple[float, PoseFit] | None = None
    # what no coefficient can tell is missed by all of them alike
    for width in WIDTHS:
        for ridge in RIDGES:
            found = fit_kernel(distances, outputs, width=width, ridge=ridge)
            missed = _left_out_mm(found, basis, regions)
            if best is None or missed < best[0]:
                best = missed, found
    assert best is not None
    return best[1], best[0]


def _left_out_mm(found: PoseFit, basis: np.ndarray, regions: np.ndarray) -> float:
    total, rows = 0.0, basis.reshape(len(basis), -1, 3)
    poses = range(0, found.left_out.shape[1], -(-found.left_out.shape[1] // MOST_LEFT_OUT))
    for pose in poses:
        mixed = regions @ found.left_out[:, pose]
        total += float(np.linalg.norm(np.einsum("vk,kvi->vi", mixed, rows), axis=1).mean())
    return 1e3 * total / len(poses)


def _left_out_skinned(garments: np.ndarray) -> float:
    """What the mean of the others, skinned, misses: the baseline."""
    count = len(garments)
    away = (garments - garments.mean(axis=0)) * count / (count - 1)
    return 1e3 * float(np.linalg.norm(away.reshape(count, -1, 3), axis=2).mean())


def _missed_mm(rows: np.ndarray, basis: np.ndarray) -> float:
    left = rows - (rows @ basis.T) @ basis
    return 1e3 * float(np.linalg.norm(left.reshape(len(rows), -1, 3), axis=2).mean())


def _shape_figures(anchors: AnchorSet, config: AgentDressConfig) -> dict[str, float]:
    """What the shape models miss of their own garments, and of each shape by a fit to the others [mm]."""
    betas, count = _used(anchors), len(anchors.betas)
    options = {"components": config.shape_components, "ridge": config.shape_ridge}
    own, without, still = [], [], []
    some = anchors.unposed[:: max(1, len(anchors.unposed) // 12)].reshape(-1, count, anchors.unposed[0, 0].size)
    for each in some.astype(np.float64):
        own.append(_apart_mm(ShapeModel.fitted(each, betas, **options).at(betas), each))
        still.append(_apart_mm(np.repeat(each[:1], count, axis=0), each))
        for shape in range(count):
            kept = np.arange(count) != shape
            model = ShapeModel.fitted(each[kept], betas[kept], **options)
            without.append(_apart_mm(model.at(betas[~kept]), each[~kept]))
    return {
        "shape_fit_mm": float(np.mean(own)),
        "shape_left_out_mm": float(np.mean(without)),
        "shape_left_out_mean_mm": float(np.mean(still)),
    }


def _apart_mm(one: np.ndarray, other: np.ndarray) -> float:
    return 1e3 * float(np.linalg.norm((one - other).reshape(len(one), -1, 3), axis=2).mean())


def _clearances(anchors: AnchorSet, binding: Binding, shaped, most: float) -> Float[np.ndarray, " verts"]:
    r"""$d_0 = \min(h_0, \epsilon_p)$, the least over the anchors of a vertex' height over the skin, which is 0 or more.

    Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations", 2021,
        Eq. 10. Differs: one value a vertex, measured in the rest pose, where all anchors are laid side by side; with
        one an anchor, what holds cloth off in one would have to be known of the next.
    """
    normals, points = shaped.normals[binding.nearest], shaped.vertices[binding.nearest]
    height = np.einsum("avi,vi->av", anchors.unposed[:, 0] - points, normals)
    return np.clip(np.percentile(height, 10, axis=0), 0.0, most).astype(np.float32)
