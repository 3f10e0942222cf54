"""The two ways to say what the shape of the body adds in a pose, fitted to the same anchors into the same tables."""

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


@dataclass(frozen=True)
class ShapeFit:
    """What the shape adds, as it is played.

    Attributes:
        basis: Directions of the garment, one a row.
        deviations: How large the coefficient of each is, root mean square [m].
        samples: What each shape adds to each direction, by pose and region.
        width: Of the kernel over poses; 1 where there is none.
        figures: What the fit reached.
        materials: What materials add to each direction, where there are others than that of the fit.
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
    """Fit what the shape adds, in the way that the options name, and what materials do.

    Args:
        anchors: How the garment lies in each pose.
        distances: Between all poses, the anchors first, squared, in each region.
        scale: What betas are multiplied by in distances between bodies, see `shape_scale`.
        regions: Share of each region in each vertex.
        config: Options; only a `kernel` takes in materials.
        materials: What other materials change; they share the basis.
    """
    if config.shape_model == "blended":
        return _by_anchor(anchors, config)
    return _by_kernel(anchors, distances, scale, regions, config, materials)


def shape_models(anchors: AnchorSet, config: AgentDressConfig) -> list[ShapeModel]:
    """What the shape does in each anchor, by the paper's model of one (Eq. 5 and 6)."""
    return [
        ShapeModel.fit(
            each.reshape(len(each), -1).astype(np.float64),
            anchors.betas,
            components=config.shape_components,
            ridge=config.shape_ridge,
        )
        for each in anchors.offsets
    ]


def _by_kernel(
    anchors: AnchorSet,
    distances: np.ndarray,
    scale: np.ndarray,
    regions: np.ndarray,
    config: AgentDressConfig,
    materials: MaterialChanges | None,
) -> ShapeFit:
    """`shape_kernel`: each region of the garment learns from all bodies."""
    poses, betas, changes = anchors.changes()
    rows = changes if materials is None else np.concatenate([changes, materials.added])
    basis, every = principal_of_rows(rows, config.shape_modes)
    outputs = every[: len(changes)]
    known = pad_betas(betas, len(scale))
    given = ShapeChanges(poses, known @ scale, outputs, anchors.groups[poses])
    found, missed_mm = best_shape_kernel(distances, given, basis, regions)
    samples = ShapeSamples(
        poses.astype(np.int32),
        known.astype(np.float32),
        found.weights.astype(np.float32),
        scale.astype(np.float32),
    )
    figures = {
        "shape_kernel_width": found.width,
        "shape_kernel_ridge": found.ridge,
        "shape_change_left_out_mm": missed_mm,
        "shape_change_mm": 1e3 * float(np.linalg.norm(changes.reshape(len(changes), -1, 3), axis=2).mean()),
    }
    told = None
    if materials is not None:
        told, of_materials = fit_materials(
            materials, every[len(changes) :], distances, anchors.groups, basis, regions
        )
        figures |= of_materials
    return ShapeFit(basis, deviations_of(every), samples, found.width, figures, told)


def _by_anchor(anchors: AnchorSet, config: AgentDressConfig) -> ShapeFit:
    """A `ShapeModel` of each anchor, as in the paper."""
    models = shape_models(anchors, config)
    basis, outputs = principal_of_rows(np.concatenate([model.effects for model in models]), config.shape_modes)
    deviations = deviations_of(np.concatenate([model.at(anchors.betas) for model in models]) @ basis.T)
    effects = outputs.reshape(len(models), -1, len(basis)).transpose(1, 0, 2)[:, None]
    return ShapeFit(basis, deviations, ShapeSamples.of_effects(effects), 1.0, {})
