"""A kernel over pose and shape together, in the place of Eq. 4's blend of shape models: judged on anchors left out."""

from collections.abc import Sequence

import numpy as np

from hemline.animators.agentdress.anchor_set import AnchorSet
from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.distances import anchor_weights, region_distances, turns_between
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.animators.agentdress.pose_model import kernel
from hemline.animators.agentdress.shape_model import ShapeModel, shape_features
from hemline.arrays import Float
from hemline.learning.pca import principal_of_rows

WIDTHS, RIDGES = (0.7, 1.0, 1.4, 2.0), (0.1, 0.3, 1.0)
"""Of the kernel over poses, over the median distance between anchors; added to the diagonal."""
SQUARES = 0.5
"""What the square of a beta counts for beside the beta."""
MODES = 128


def shape_errors(model: AnimatorAgentDress, anchors: AnchorSet) -> dict[str, float]:
    """What is missed of the change from the mean shape to the others, at anchors that are left out, by way [mm].

    Width and ridge of the joint kernel are chosen at every other anchor, and judged at those between.
    """
    changes = (anchors.offsets[:, 1:] - anchors.offsets[:, :1]).astype(np.float64)
    influence = model.tables.influence.astype(np.float64)
    distances = region_distances(turns_between(anchors.rotations, anchors.rotations), influence)
    regions, count = model.tables.regions.astype(np.float64), len(changes)
    judged = range(1, count, 2)
    blended = _blended(anchors, distances, regions)
    joint = _joint(anchors, changes, distances, regions, range(0, count, 2), judged)
    return {
        "nothing": _mm([changes[number] for number in judged]),
        "mean over anchors": _mm([changes[n] - np.delete(changes, n, axis=0).mean(axis=0) for n in judged]),
        "shape models of five anchors, blended (Eq. 4)": _mm([changes[n] - blended[n] for n in judged]),
        "joint kernel": joint,
    }


def _blended(anchors: AnchorSet, distances: np.ndarray, regions: np.ndarray) -> Float[np.ndarray, "a s v 3"]:
    """Eq. 4 at each anchor, from the others."""
    config, found = AgentDressConfig(), []
    options = {name: getattr(config, name) for name in ("neighbours", "power", "floor")}
    models = [
        ShapeModel.fitted(
            each.reshape(len(each), -1).astype(np.float64),
            anchors.betas,
            components=config.shape_components,
            ridge=config.shape_ridge,
        )
        for each in anchors.offsets
    ]
    zero = np.zeros_like(anchors.betas[:1])
    effects = np.array([(each.at(anchors.betas[1:]) - each.at(zero)) for each in models])
    effects = effects.reshape(*effects.shape[:2], -1, 3)
    for number in range(len(models)):
        others = np.delete(np.arange(len(models)), number)
        weights = np.zeros((len(distances[0]), len(models)))
        weights[:, others] = anchor_weights(distances[number][:, others], **options)
        found.append(np.einsum("va,asvi->svi", regions @ weights, effects))
    return np.array(found)


def _joint(
    anchors: AnchorSet,
    changes: np.ndarray,
    distances: np.ndarray,
    regions: np.ndarray,
    chosen_at: Sequence[int],
    judged_at: Sequence[int],
) -> float:
    """Kernel ridge regression of the changes with a product of kernels, linear in the features of the shape."""
    anchor_count, shape_count = changes.shape[:2]
    features = shape_features(anchors.betas[1:]) * np.repeat([1.0, SQUARES], anchors.betas.shape[1])
    over_shapes = features @ features.T
    basis, outputs = principal_of_rows(changes.reshape(anchor_count * shape_count, -1), MODES)
    rows, best = basis.reshape(len(basis), -1, 3), None
    for width in WIDTHS:
        for ridge in RIDGES:
            missed = np.array(
                [
                    _left_out(np.kron(kernel(distances[:, region], width), over_shapes), outputs, shape_count, ridge)
                    for region in range(distances.shape[1])
                ]
            )
            at = missed.reshape(len(missed), anchor_count, shape_count, -1)

            def error(numbers: Sequence[int], at: np.ndarray = at) -> float:
                return _mm([np.einsum("vg,gsk,kvi->svi", regions, at[:, n], rows, optimize=True) for n in numbers])

            chosen = error(chosen_at)
            if best is None or chosen < best[0]:
                best = chosen, error(judged_at)
    assert best is not None
    return best[1]


def _left_out(gram: np.ndarray, outputs: np.ndarray, group: int, ridge: float) -> np.ndarray:
    """What is missed of each group of rows by a fit to all others, in closed form."""
    inverse = np.linalg.inv(gram + ridge * np.eye(len(gram)))
    weights, missed = inverse @ outputs, np.empty_like(outputs)
    for begin in range(0, len(gram), group):
        rows = slice(begin, begin + group)
        missed[rows] = np.linalg.solve(inverse[rows, rows], weights[rows])
    return missed


def _mm(missed: Sequence[np.ndarray]) -> float:
    return 1e3 * float(np.mean([np.linalg.norm(each, axis=-1).mean() for each in missed]))
