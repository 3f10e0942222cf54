"""The fit of the pose model to the garments on the mean shape and their mirror images."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Self

import numpy as np

from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.distances import axes_between, region_distances
from hemline.animators.agentdress.pose_model import POSE_RIDGES, POSE_WIDTHS, PoseFit, fit_kernel
from hemline.arrays import Float
from hemline.learning.mirror import MirrorImage
from hemline.learning.pca import principal_of_rows

from .anchor_set import AnchorSet
from .leave_one_out import leave_one_out_mm
from .mirror_images import add_mirror_images


@dataclass(frozen=True)
class PoseModelFit:
    """The effect of poses on the mean shape.

    Attributes:
        anchors: The training data.
        rotations: All poses of the training data.
        distances: Squared distances between these poses, per region.
        offsets: Offsets of the garment from the skinned one in each pose [m].
        mean: Mean of the offsets.
        basis: Principal directions of the offsets, one per row.
        outputs: Offsets from the mean, as coefficients of the basis [m].
        fit: Regression from poses to these coefficients.
        leave_one_out_mm: Leave-one-out error of the regression [mm].
    """

    anchors: AnchorSet
    rotations: Float[np.ndarray, "poses joints 4"]
    distances: Float[np.ndarray, "poses regions poses"]
    offsets: Float[np.ndarray, "poses rows"]
    mean: Float[np.ndarray, " rows"]
    basis: Float[np.ndarray, "modes rows"]
    outputs: Float[np.ndarray, "poses modes"]
    fit: PoseFit
    leave_one_out_mm: float

    @classmethod
    def search(
        cls,
        anchors: AnchorSet,
        axes: Float[np.ndarray, "regions axes"],
        regions: Float[np.ndarray, "verts regions"],
        config: AgentDressConfig,
    ) -> Self:
        """Fits the regression with the width and ridge weight that minimise the leave-one-out error.

        Args:
            anchors: The training data.
            axes: Weights of the joint axes in each region.
            regions: Weight of each region at each vertex.
            config: Options.
        """
        rotations = np.concatenate([anchors.rotations, anchors.single_rotations])
        offsets = np.concatenate([anchors.offsets[:, 0], anchors.single_offsets])
        offsets = offsets.reshape(len(rotations), -1).astype(np.float64)
        mean = offsets.mean(axis=0)
        basis, outputs = principal_of_rows(offsets - mean, config.pose_modes)
        distances = region_distances(axes_between(rotations, rotations), axes)

        def attempt(width: float, ridge: float) -> tuple[float, PoseFit]:
            candidate = fit_kernel(distances, outputs, anchors.groups, width=width, ridge=ridge)
            return leave_one_out_mm(candidate.leave_one_out, basis, regions), candidate

        error_mm, best = _best_in_turn(attempt)
        fit = fit_kernel(distances, outputs, anchors.groups, width=best.width, ridge=best.ridge, rounded=True)
        return cls(anchors, rotations, distances, offsets, mean, basis, outputs, fit, error_mm)


def _best_in_turn(attempt: Callable[[float, float], tuple[float, PoseFit]]) -> tuple[float, PoseFit]:
    """Returns the fit of least error: the best width for a middle ridge, the best ridge for that, the width again.

    With the error as smooth as it is in practice, this finds the best of all pairs with a third of the fits.

    Args:
        attempt: Fits with a width and a ridge; returns the error and the fit.
    """
    ridge = POSE_RIDGES[len(POSE_RIDGES) // 2]
    tried = {(width, ridge): attempt(width, ridge) for width in POSE_WIDTHS}
    for turn in range(2):
        width, ridge = min(tried, key=lambda pair: tried[pair][0])
        others = [(width, each) for each in POSE_RIDGES] if turn == 0 else [(each, ridge) for each in POSE_WIDTHS]
        tried |= {pair: attempt(*pair) for pair in others if pair not in tried}
    return min(tried.values(), key=lambda each: each[0])


def best_pose_fit(
    anchors: AnchorSet,
    image: MirrorImage | None,
    axes: Float[np.ndarray, "regions axes"],
    regions: Float[np.ndarray, "verts regions"],
    config: AgentDressConfig,
) -> PoseModelFit:
    """Fits the pose model with both ways to mirror a garment, and returns the fit of less leave-one-out error.

    Args:
        anchors: The anchors.
        image: Mirror image of the garment; None: nothing is mirrored.
        axes: Weights of the joint axes in each region.
        regions: Weight of each region at each vertex.
        config: Options.
    """
    variants = [anchors]
    if image is not None:
        variants = [add_mirror_images(anchors, image, rest_too=rest_too) for rest_too in (False, True)]
    fits = [PoseModelFit.search(variant, axes, regions, config) for variant in variants]
    return min(fits, key=lambda each: each.leave_one_out_mm)
