"""The two models of the effect of body shape, a kernel and blended anchors, fitted to the same anchors."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.materials import Materials
from hemline.animators.agentdress.shape_model import ShapeModel, pad_betas
from hemline.animators.agentdress.shape_samples import ShapeSamples
from hemline.arrays import Float
from hemline.learning.pca import deviations_of, principal_of_rows

from .anchor_set import AnchorSet
from .material_fit import MaterialChanges, fit_materials
from .shape_kernel import ShapeChanges, best_shape_kernel

UNUSED_DEVIATION = 1e-3
"""Scale of the basis mode that a model of one shape does not use [m]."""


@dataclass(frozen=True)
class ShapeFit:
    """The fitted effect of the body shape.

    Attributes:
        basis: Modes of the garment, one per row.
        deviations: Root mean square coefficient of each mode [m].
        samples: Effect of each draped shape on each mode, per pose and region.
        width: Width of the kernel over poses; 1 without a kernel.
        figures: Figures of the fit.
        materials: Effect of materials on each mode, if other materials than that of the fit were draped.
    """

    basis: Float[np.ndarray, "modes rows"]
    deviations: Float[np.ndarray, " modes"]
    samples: ShapeSamples
    width: float
    figures: Mapping[str, float]
    materials: Materials | None = None


def fit_shapes(
    anchors: AnchorSet,
    distances: Float[np.ndarray, "poses regions poses"],
    scale: Float[np.ndarray, "betas betas"],
    regions: Float[np.ndarray, "verts regions"],
    config: AgentDressConfig,
    materials: MaterialChanges | None = None,
) -> ShapeFit:
    """Fits the shape model named by the options, and the effect of materials.

    Args:
        anchors: The anchors.
        distances: Squared distances between all poses, anchors first, per region.
        scale: Matrix by which betas are multiplied in distances between bodies, see `shape_scale`.
        regions: Weight of each region at each vertex.
        config: Options; only the `kernel` model supports materials.
        materials: Changes in other materials, which share the basis.
    """
    if len(anchors.betas) == 1 and not len(anchors.other_betas):
        return _no_effect(anchors, scale)
    if config.shape_model == "blended":
        return _by_anchor(anchors, config)
    return _by_kernel(anchors, distances, scale, regions, config, materials)


def _no_effect(anchors: AnchorSet, scale: np.ndarray) -> ShapeFit:
    """Returns a model without an effect of the shape besides that on the garment at rest, for anchors of one shape."""
    basis = np.zeros((1, anchors.rest.mean.size))
    basis[0, 0] = 1.0
    size = scale.astype(np.float32)
    samples = ShapeSamples(
        np.zeros(1, np.int32), np.ones((1, len(size)), np.float32), np.zeros((1, 1, 1), np.float32), size
    )
    return ShapeFit(basis, np.full(1, UNUSED_DEVIATION), samples, 1.0, {})


def shape_models(anchors: AnchorSet, config: AgentDressConfig) -> list[ShapeModel]:
    """Fits the shape model of the paper to each anchor (Eq. 5 and 6)."""
    return [
        ShapeModel.fit(
            offsets.reshape(len(offsets), -1).astype(np.float64),
            anchors.betas,
            components=config.shape_components,
            ridge=config.shape_ridge,
        )
        for offsets in anchors.offsets
    ]


def _by_kernel(
    anchors: AnchorSet,
    distances: np.ndarray,
    scale: np.ndarray,
    regions: np.ndarray,
    config: AgentDressConfig,
    materials: MaterialChanges | None,
) -> ShapeFit:
    """Fits the kernel over pose and shape (`shape_kernel`)."""
    poses, betas, changes = anchors.changes()
    rows = changes if materials is None else np.concatenate([changes, materials.added])
    basis, coefficients = principal_of_rows(rows, config.shape_modes)
    outputs = coefficients[: len(changes)]
    padded = pad_betas(betas, len(scale))
    training = ShapeChanges(poses, padded @ scale, outputs, anchors.groups[poses])
    best, error_mm = best_shape_kernel(distances, training, basis, regions)
    samples = ShapeSamples(
        poses.astype(np.int32),
        padded.astype(np.float32),
        best.weights.astype(np.float32),
        scale.astype(np.float32),
        sizes=np.stack([each.sizes for each in best.packed]),
        steps=np.stack([each.steps for each in best.packed]),
    )
    figures = {
        "shape_kernel_width": best.width,
        "shape_kernel_ridge": best.ridge,
        "shape_change_left_out_mm": error_mm,
        "shape_change_mm": 1e3 * float(np.linalg.norm(changes.reshape(len(changes), -1, 3), axis=2).mean()),
    }
    effects = None
    if materials is not None:
        material_outputs = coefficients[len(changes) :]
        effects, more = fit_materials(materials, material_outputs, distances, anchors.groups, basis, regions)
        figures |= more
    return ShapeFit(basis, deviations_of(coefficients), samples, best.width, figures, effects)


def _by_anchor(anchors: AnchorSet, config: AgentDressConfig) -> ShapeFit:
    """Fits a `ShapeModel` to each anchor, as in the paper."""
    models = shape_models(anchors, config)
    basis, outputs = principal_of_rows(np.concatenate([model.effects for model in models]), config.shape_modes)
    deviations = deviations_of(np.concatenate([model.at(anchors.betas) for model in models]) @ basis.T)
    effects = outputs.reshape(len(models), -1, len(basis)).transpose(1, 0, 2)[:, None]
    return ShapeFit(basis, deviations, ShapeSamples.of_effects(effects), 1.0, {})
