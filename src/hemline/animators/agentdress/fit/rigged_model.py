"""Models whose pose model consists of rigged anchors."""

from dataclasses import replace

import numpy as np

from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.animators.agentdress.sor.rigged_tables import RiggedTables
from hemline.learning.packed_basis import PackedBasis

from .rigged_anchors import RiggedAnchors

KERNEL_FIGURES = ("kernel_width", "kernel_ridge", "pose_basis_mm")
"""Figures of a fit whose pose model is a kernel."""


def with_rigging(rigged: RiggedAnchors) -> AnimatorAgentDress:
    """Replaces the pose model of the model of rigged anchors by these anchors.

    The result keeps only those other poses in which several shapes were draped.

    Args:
        rigged: The anchors.
    """
    model, tables = rigged.model, rigged.model.tables
    count, modes = tables.shapes.pose_count, tables.pose_weights.shape[2]
    rotations = rigged.rotations.astype(np.float32)
    differences = np.abs(tables.rotations[:count, None] - rotations).max(axis=(2, 3))
    known = differences.min(axis=0) == 0
    poses = np.where(known, differences.argmin(axis=0), count - 1 + np.cumsum(~known))
    rotations = np.concatenate([tables.rotations[:count], rotations[~known]])
    basis, of_shape = tables.basis, tables.basis.modes >= modes
    digits, scales = np.ascontiguousarray(basis.digits[:, of_shape]), basis.scales[of_shape]
    figures = {name: value for name, value in model.figures.items() if name not in KERNEL_FIGURES} | {
        "poses": float(len(rotations)),
        "rigged": float(len(poses)),
        "rigging_stiffness": rigged.stiffness,
        "pose_left_out_mm": rigged.validation_mm,
        "error_to_expect_mm": rigged.validation_mm + model.figures["shape_left_out_mm"],
    }
    return replace(
        model,
        tables=replace(
            tables,
            rotations=rotations,
            basis=PackedBasis(digits, scales, basis.modes[of_shape] - np.int32(modes)),
            pose_weights=np.zeros((tables.regions.shape[1], len(rotations), 0), np.float32),
            rigged=RiggedTables.pack(rigged.rigging, poses),
        ),
        config=replace(model.config, pose_model="sor"),
        figures=figures,
    )
