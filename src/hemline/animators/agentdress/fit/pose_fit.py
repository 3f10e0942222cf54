"""The pose model fitted to the garments on the mean shape, and to their mirror images."""

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
    """What poses add on the mean shape.

    Attributes:
        given: What it is fitted to.
        rotations: Of all its poses.
        distances: Between them, squared, in each region.
        offsets: The garment in each [m].
        mean: Of the offsets.
        basis: Their principal directions, one a row.
        outputs: What is added to the mean, as coefficients of the basis [m].
        fit: The regression from poses to them.
        left_out_mm: What it misses of poses that are left out [mm].
    """

    given: AnchorSet
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
        given: AnchorSet,
        axes: Float[np.ndarray, "regions axes"],
        regions: Float[np.ndarray, "verts regions"],
        config: AgentDressConfig,
    ) -> Self:
        """By the width and ridge that miss least of poses that are left out.

        Args:
            given: What is learned from.
            axes: What the axes of the joints count for in each region.
            regions: Share of each region in each vertex.
            config: Options.
        """
        rotations = np.concatenate([given.rotations, given.single_rotations])
        offsets = np.concatenate([given.offsets[:, 0], given.single_offsets])
        offsets = offsets.reshape(len(rotations), -1).astype(np.float64)
        mean = offsets.mean(axis=0)
        basis, outputs = principal_of_rows(offsets - mean, config.pose_modes)
        distances = region_distances(axes_between(rotations, rotations), axes)
        best: tuple[float, PoseFit] | None = None
        for width in POSE_WIDTHS:
            for ridge in POSE_RIDGES:
                found = fit_kernel(distances, outputs, given.groups, width=width, ridge=ridge)
                missed = leave_one_out_mm(found.leave_one_out, basis, regions)
                if best is None or missed < best[0]:
                    best = missed, found
        assert best is not None
        return cls(given, rotations, distances, offsets, mean, basis, outputs, best[1], best[0])


def best_pose_fit(
    anchors: AnchorSet,
    image: MirrorImage | None,
    axes: Float[np.ndarray, "regions axes"],
    regions: Float[np.ndarray, "verts regions"],
    config: AgentDressConfig,
) -> PoseModelFit:
    """Of the two ways to mirror a garment, the one that misses less of poses that are left out.

    Args:
        anchors: How the garment lies in each pose.
        image: Of the garment; None: nothing is mirrored.
        axes: What the axes of the joints count for in each region.
        regions: Share of each region in each vertex.
        config: Options.
    """
    ways = [anchors]
    if image is not None:
        ways = [add_mirror_images(anchors, image, rest_too=way) for way in (False, True)]
    found = [PoseModelFit.search(each, axes, regions, config) for each in ways]
    return min(found, key=lambda each: each.leave_one_out_mm)
