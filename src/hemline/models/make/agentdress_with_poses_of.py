"""AgentDress fitted to a dataset and to the poses that an earlier model of the garment holds.

    python -m hemline.models.make.agentdress_with_poses_of DATASET MODEL NEW

A kernel regression holds what it was fitted to: its weights, times its own kernel matrix with the ridge, are its
outputs. So a model keeps the drapes on the mean body of a dataset that is gone, as far as its basis tells them.
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from hemline import animators, bodies
from hemline.animators.agentdress.anchor_set import AnchorSet
from hemline.animators.agentdress.binding import Binding
from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.distances import axes_between, region_distances
from hemline.animators.agentdress.fit import fit_anchors
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.animators.agentdress.pose_model import kernel
from hemline.animators.agentdress.suitability import suitability
from hemline.datasets import open_dataset
from hemline.motions.motion import Pose


def told(model: AnimatorAgentDress) -> np.ndarray:
    """The garment beside skinning in each pose that a model was fitted to (poses, verts, 3) [m]."""
    tables = model.tables
    rotations, axes = tables.rotations.astype(np.float64), tables.axes.astype(np.float64)
    apart = region_distances(axes_between(rotations, rotations), axes)
    ridge = model.figures["kernel_ridge"] * np.eye(len(rotations))
    each = zip(range(len(axes)), tables.pose_weights.astype(np.float64), strict=True)
    found = [(kernel(apart[:, region], model.width) + ridge) @ weights for region, weights in each]
    basis, modes = tables.basis.unpacked().astype(np.float64), tables.pose_weights.shape[2]
    return tables.offset + (np.mean(found, axis=0) @ basis[:modes]).reshape(len(rotations), -1, 3)


def with_poses_of(anchors: AnchorSet, model: AnimatorAgentDress) -> AnchorSet:
    """The anchors, and beside them the poses of a model that they do not have."""
    tables = model.tables
    binding, shaped = Binding(tables.indices, tables.weights, tables.nearest), bodies.load(model.body_name).shaped()
    known = np.concatenate([anchors.rotations, anchors.single_rotations])
    at_rest = anchors.rest.at(anchors.betas[:1])[0].reshape(-1, 3)
    rotations, offsets = [], []
    for turned, lying in zip(tables.rotations, told(model), strict=True):
        if np.abs(known - turned).max(axis=(1, 2)).min() > 1e-6:
            transforms = shaped.posed(Pose(turned, shaped.rest_pose.translation)).transforms
            worn = binding.posed(transforms, tables.rest, lying)
            rotations.append(turned)
            offsets.append(anchors.binding.offsets(transforms, at_rest, worn))
    return replace(
        anchors,
        single_rotations=np.concatenate([anchors.single_rotations, np.array(rotations)]),
        single_offsets=np.concatenate([anchors.single_offsets, np.array(offsets, np.float32)]),
        together=np.arange(len(anchors.together) + len(rotations)),
    )


def main(folder: Path, name: str, output: Path) -> None:
    """Fit, and write the model."""
    dataset, model = open_dataset(folder), animators.load(name)
    assert isinstance(model, AnimatorAgentDress)
    anchors = AnchorSet.of(dataset)
    both = with_poses_of(anchors, model)
    found = fit_anchors(dataset.garment, both, AgentDressConfig(), progress=lambda stage, done, total: None)
    replace(found, figures=dict(found.figures) | suitability(dataset, anchors)).save(output)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2], Path(sys.argv[3]))
