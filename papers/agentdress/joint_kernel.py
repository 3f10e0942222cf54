"""A kernel over pose and shape together beside Eq. 4's blend of shape models: judged on anchors left out."""

from collections.abc import Sequence

import numpy as np

from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.distances import anchor_weights, axes_between, region_distances
from hemline.animators.agentdress.fit.anchor_set import AnchorSet
from hemline.animators.agentdress.fit.shape_fit import shape_models
from hemline.animators.agentdress.fit.shape_kernel import SHAPE_RIDGES, SHAPE_WIDTHS, ShapeChanges, fit_shape_kernel
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.animators.agentdress.shape_model import pad_betas
from hemline.arrays import Float
from hemline.learning.pca import principal_of_rows

MODES = 64
"""Of the basis, as in `AgentDressConfig`."""


def shape_errors(model: AnimatorAgentDress, anchors: AnchorSet) -> dict[str, float]:
    """What is missed of the change from the mean shape to the others, at anchors that are left out, by way [mm].

    Width and ridge of the joint kernel are chosen at every other anchor, and judged at those between.
    """
    changes = (anchors.offsets[:, 1:] - anchors.offsets[:, :1]).astype(np.float64)
    weights, scale = model.tables.axes.astype(np.float64), model.tables.shapes.scale.astype(np.float64)
    distances = region_distances(axes_between(anchors.rotations, anchors.rotations), weights)
    regions, count = model.tables.regions.astype(np.float64), len(changes)
    judged = range(1, count, 2)
    blended = _blended(anchors, distances, regions)
    where = pad_betas(anchors.betas[1:], len(scale)) @ scale
    joint = _joint(where, changes, distances, regions, range(0, count, 2), judged)
    return {
        "nothing": _mm([changes[number] for number in judged]),
        "mean over anchors": _mm([changes[n] - np.delete(changes, n, axis=0).mean(axis=0) for n in judged]),
        "shape models of five anchors, blended (Eq. 4)": _mm([changes[n] - blended[n] for n in judged]),
        "kernel over pose and shape": joint,
    }


def _blended(anchors: AnchorSet, distances: np.ndarray, regions: np.ndarray) -> Float[np.ndarray, "a s v 3"]:
    """Eq. 4 at each anchor, from the others."""
    config, found = AgentDressConfig(), []
    models = shape_models(anchors, config)
    zero = np.zeros_like(anchors.betas[:1])
    effects = np.array([(each.at(anchors.betas[1:]) - each.at(zero)) for each in models])
    effects = effects.reshape(*effects.shape[:2], -1, 3)
    for number in range(len(models)):
        others = np.delete(np.arange(len(models)), number)
        weights = np.zeros((len(distances[0]), len(models)))
        weights[:, others] = anchor_weights(distances[number][:, others], **config.blending)
        found.append(np.einsum("va,asvi->svi", regions @ weights, effects))
    return np.array(found)


def _joint(
    where: np.ndarray,
    changes: np.ndarray,
    distances: np.ndarray,
    regions: np.ndarray,
    chosen_at: Sequence[int],
    judged_at: Sequence[int],
) -> float:
    """What `hemline fit` makes, its width and ridge chosen at some anchors and judged at others."""
    basis, outputs = principal_of_rows(changes.reshape(changes.shape[0] * changes.shape[1], -1), MODES)
    count, shapes = changes.shape[:2]
    poses = np.repeat(np.arange(count), shapes)
    given = ShapeChanges(poses, np.tile(where, (count, 1)), outputs, poses)
    rows, best = basis.reshape(len(basis), -1, 3), None
    for width in SHAPE_WIDTHS:
        for ridge in SHAPE_RIDGES:
            left_out = fit_shape_kernel(distances, given, width=width, ridge=ridge).leave_one_out
            missed = left_out.reshape(len(left_out), count, shapes, -1)

            def error(numbers: Sequence[int], missed: np.ndarray = missed) -> float:
                return _mm([np.einsum("vg,gsk,kvi->svi", regions, missed[:, n], rows, optimize=True) for n in numbers])

            chosen = error(chosen_at)
            if best is None or chosen < best[0]:
                best = chosen, error(judged_at)
    assert best is not None
    return best[1]


def _mm(missed: Sequence[np.ndarray]) -> float:
    return 1e3 * float(np.mean([np.linalg.norm(each, axis=-1).mean() for each in missed]))
