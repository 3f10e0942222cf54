"""Errors of the shape models."""

import numpy as np

from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.shape_model import ShapeModel

from .anchor_set import AnchorSet


def shape_figures(anchors: AnchorSet, config: AgentDressConfig) -> dict[str, float]:
    """Returns the errors of the shape models on their training garments and in leave-one-out tests [mm].

    There are none if all anchors are of one shape.
    """
    if len(anchors.betas) == 1:
        return {}
    betas, count = anchors.betas, len(anchors.betas)
    options = {"components": config.shape_components, "ridge": config.shape_ridge}
    rests = anchors.rest.at(betas)
    training, validation, baseline, explained = [], [], [], []
    some = anchors.offsets[:: max(1, len(anchors.offsets) // 12)].reshape(-1, count, rests.shape[1])
    for garments in rests + some.astype(np.float64):
        full = ShapeModel.fit(garments, betas, **options)
        explained.append(full.explained)
        training.append(_distance_mm(full.at(betas), garments))
        baseline.append(_distance_mm(np.repeat(garments[:1], count, axis=0), garments))
        for shape in range(count):
            kept = np.arange(count) != shape
            model = ShapeModel.fit(garments[kept], betas[kept], **options)
            validation.append(_distance_mm(model.at(betas[~kept]), garments[~kept]))
    return {
        "shape_explained_share": float(np.mean(explained)),
        "shape_fit_mm": float(np.mean(training)),
        "shape_left_out_mm": float(np.mean(validation)),
        "shape_left_out_mean_mm": float(np.mean(baseline)),
    }


def _distance_mm(one: np.ndarray, other: np.ndarray) -> float:
    return 1e3 * float(np.linalg.norm((one - other).reshape(len(one), -1, 3), axis=2).mean())
