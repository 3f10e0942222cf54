"""What shape models miss."""

import numpy as np

from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.shape_model import ShapeModel

from .anchor_set import AnchorSet


def shape_figures(anchors: AnchorSet, config: AgentDressConfig) -> dict[str, float]:
    """What the shape models miss of their own garments, and of each shape by a fit to the others [mm]."""
    betas, count = anchors.betas, len(anchors.betas)
    options = {"components": config.shape_components, "ridge": config.shape_ridge}
    rests = anchors.rest.at(betas)
    own, without, still, explained = [], [], [], []
    some = anchors.offsets[:: max(1, len(anchors.offsets) // 12)].reshape(-1, count, rests.shape[1])
    for each in rests + some.astype(np.float64):
        whole = ShapeModel.fit(each, betas, **options)
        explained.append(whole.explained)
        own.append(_distance_mm(whole.at(betas), each))
        still.append(_distance_mm(np.repeat(each[:1], count, axis=0), each))
        for shape in range(count):
            kept = np.arange(count) != shape
            model = ShapeModel.fit(each[kept], betas[kept], **options)
            without.append(_distance_mm(model.at(betas[~kept]), each[~kept]))
    return {
        "shape_explained_share": float(np.mean(explained)),
        "shape_fit_mm": float(np.mean(own)),
        "shape_left_out_mm": float(np.mean(without)),
        "shape_left_out_mean_mm": float(np.mean(still)),
    }


def _distance_mm(one: np.ndarray, other: np.ndarray) -> float:
    return 1e3 * float(np.linalg.norm((one - other).reshape(len(one), -1, 3), axis=2).mean())
