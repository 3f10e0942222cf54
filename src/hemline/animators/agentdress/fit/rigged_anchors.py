"""Sensitivity-optimised rigging of the anchors of a dataset, validated on poses outside its training set."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from hemline.animators.agentdress.distances import anchor_weights, axes_between, region_distances
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.animators.agentdress.sor.rigging import Rigging
from hemline.animators.base import Progress
from hemline.arrays import Float, Int
from hemline.bodies.body import ShapedBody
from hemline.datasets import Dataset, Row
from hemline.datasets.joint_sensitivity import derivatives_by_joint
from hemline.errors import BadDataset
from hemline.motions.motion import Pose

from .anchor_set import AnchorSet, is_t_pose

STIFFNESSES = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1.0)
"""Candidate stiffnesses of the weights, relative to the cost of all derivatives."""

VALIDATION_STEP = 4
"""Step through the single poses that selects the ones used for validation."""


def rows_with_derivatives(dataset: Dataset) -> list[Row]:
    """Returns the anchors on the mean shape that have derivatives for all joints, without the T-pose.

    Raises:
        BadDataset: There are fewer than two such anchors.
    """
    rows = []
    for row in dataset.anchors():
        if not any(row.betas):
            take = dataset.take(row)
            if "turn.0.0" in take.derivatives and not is_t_pose(take.motion[0]):
                rows.append(row)
    if len(rows) < 2:
        raise BadDataset(
            f"{dataset.folder} holds fewer than two anchors with derivatives, which rigging learns from",
            len(rows),
            "run the same 'hemline drape' again with --derivatives, or fit with --pose-model kernel",
        )
    return rows


def anchor_blend(
    model: AnimatorAgentDress, rotations: Float[np.ndarray, "anchors joints 4"], pose: Pose
) -> Float[np.ndarray, "verts anchors"]:
    """Returns the weight of each anchor at each vertex (Eq. 7 and 8)."""
    axes = axes_between(pose.rotations[None].astype(np.float64), rotations)
    distances = region_distances(axes, model.tables.axes.astype(np.float64))[0]
    return model.tables.regions @ anchor_weights(distances, **model.config.blending)


@dataclass(frozen=True, eq=False)
class RiggedAnchors:
    """The rigging of all anchors that have derivatives.

    Attributes:
        model: Model whose regions and distances give the blend weights.
        anchors: Anchors whose binding and rest garment define the offsets.
        shaped: The mean body.
        rotations: Poses of the rigged anchors.
        rigging: Garments and skin weights of the rigged anchors.
        stiffness: Stiffness of the skin weights.
    """

    model: AnimatorAgentDress
    anchors: AnchorSet
    shaped: ShapedBody
    rotations: Float[np.ndarray, "rigged joints 4"]
    rigging: Rigging
    stiffness: float

    @classmethod
    def rig(
        cls, dataset: Dataset, rows: Sequence[Row], model: AnimatorAgentDress, anchors: AnchorSet, stiffness: float
    ) -> Self:
        """Rigs anchors with a given stiffness.

        Args:
            dataset: The dataset of the anchors.
            rows: The anchors, see `rows_with_derivatives`.
            model: A model fitted to the same dataset.
            anchors: The anchors read from the dataset.
            stiffness: Cost of changing the weights, relative to the cost of all joint derivatives.
        """
        shaped = dataset.body.shaped()
        poses, vertices = zip(*((take.motion[0], take.vertices[0]) for take in map(dataset.take, rows)), strict=True)
        rigging = Rigging.fit(
            [shaped.posed(pose) for pose in poses],
            np.array(vertices, np.float64),
            (derivatives_by_joint(dataset.take(row), dataset.body) for row in rows),
            anchors.binding.dense_weights(),
            stiffness,
        )
        rotations = np.array([pose.rotations for pose in poses], np.float64)
        return cls(model, anchors, shaped, rotations, rigging, stiffness)

    @classmethod
    def search(
        cls,
        dataset: Dataset,
        rows: Sequence[Row],
        model: AnimatorAgentDress,
        anchors: AnchorSet,
        progress: Progress | None = None,
    ) -> Self:
        """Rigs anchors with the stiffness of least validation error; see `rig`."""

        def candidates() -> Iterator[Self]:
            for number, stiffness in enumerate(STIFFNESSES):
                yield cls.rig(dataset, rows, model, anchors, stiffness)
                if progress:
                    progress("rigging", number + 1, len(STIFFNESSES))

        return min(candidates(), key=lambda each: each.validation_mm)

    @cached_property
    def validation_mm(self) -> float:
        """Mean error on every fourth single pose, which rigging is not trained on [mm].

        Without single poses it is the leave-one-out error of the rigged anchors.
        """
        rotations, offsets = self.anchors.single_rotations, self.anchors.single_offsets
        samples = zip(rotations[::VALIDATION_STEP], offsets[::VALIDATION_STEP], strict=True)
        errors = [self._error_mm(*sample) for sample in samples] or self._leave_one_out_mm()
        return float(np.mean(errors))

    def _leave_one_out_mm(self) -> list[float]:
        indices, rigging, errors = np.arange(len(self.rotations)), self.rigging, []
        for anchor, rotations in enumerate(self.rotations):
            truth = rigging.transforms[anchor], self.model.tables.rest, rigging.vertices[anchor]
            others = self.subset(np.delete(indices, anchor))
            errors.append(others._error_mm(rotations, self.anchors.binding.offsets(*truth)))
        return errors

    def _error_mm(self, rotations: Float[np.ndarray, "joints 4"], offsets: Float[np.ndarray, "verts 3"]) -> float:
        predicted = self(Pose(rotations, self.shaped.rest_pose.translation))
        return 1e3 * float(np.linalg.norm(predicted - offsets, axis=1).mean())

    def __call__(self, pose: Pose) -> Float[np.ndarray, "verts 3"]:
        """Predicts the offsets in a pose, on the mean shape [m]."""
        transforms = self.shaped.posed(pose).transforms
        vertices = self.rigging.at(transforms, anchor_blend(self.model, self.rotations, pose))
        return self.anchors.binding.offsets(transforms, self.model.tables.rest, vertices)

    def subset(self, some: Int[np.ndarray, " some"]) -> "RiggedAnchors":
        """Returns a subset of the rigged anchors."""
        full = self.rigging
        rigging = Rigging(full.transforms[some], full.vertices[some], full.weights[some])
        return replace(self, rotations=self.rotations[some], rigging=rigging)
