"""Sensitivity-optimised rigging of the anchors of a dataset, judged on poses that it does not know."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from hemline import bodies
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
"""Of the weights, over what all derivatives cost, that are tried."""

VALIDATION_STEP = 4
"""Of the poses beside the anchors, so many-th is used to choose."""


def rows_with_derivatives(dataset: Dataset) -> list[Row]:
    """Anchors on the mean shape that have derivatives by all joints, the T-pose left out.

    Raises:
        BadDataset: There are fewer than two.
    """
    found = []
    for row in dataset.anchors():
        if not any(row.betas):
            take = dataset.take(row)
            if "turn.0.0" in take.derivatives and not is_t_pose(take.motion[0]):
                found.append(row)
    if len(found) < 2:
        raise BadDataset(
            f"{dataset.folder} holds fewer than two anchors with derivatives, which rigging learns from",
            len(found),
            "run the same 'hemline drape' again with --derivatives, or fit with --pose-model kernel",
        )
    return found


def anchor_blend(
    model: AnimatorAgentDress, rotations: Float[np.ndarray, "anchors joints 4"], pose: Pose
) -> Float[np.ndarray, "verts anchors"]:
    """Eq. 7 and 8: what each anchor counts for at each vertex."""
    turns = axes_between(pose.rotations[None].astype(np.float64), rotations)
    distances = region_distances(turns, model.tables.axes.astype(np.float64))[0]
    return model.tables.regions @ anchor_weights(distances, **model.config.blending)


@dataclass(frozen=True, eq=False)
class RiggedAnchors:
    """The anchors that have derivatives, rigged.

    Attributes:
        model: Whose regions and distances weigh them.
        anchors: Whose binding and rest the offsets are told in.
        shaped: The mean body.
        rotations: Of the rigged anchors.
        rigging: Their garments and weights.
        stiffness: Of its weights.
    """

    model: AnimatorAgentDress
    anchors: AnchorSet
    shaped: ShapedBody
    rotations: Float[np.ndarray, "rigged joints 4"]
    rigging: Rigging
    stiffness: float

    @classmethod
    def at(
        cls, dataset: Dataset, rows: Sequence[Row], model: AnimatorAgentDress, anchors: AnchorSet, stiffness: float
    ) -> Self:
        """Rig them at one stiffness.

        Args:
            dataset: Where they are.
            rows: Which they are, see `rows_with_derivatives`.
            model: Fitted to the same dataset.
            anchors: Read from it.
            stiffness: How much a change of the weights costs, over what all joints' derivatives cost.
        """
        shaped = bodies.load(model.body_name).shaped()
        poses, worn = zip(*((take.motion[0], take.vertices[0]) for take in map(dataset.take, rows)), strict=True)
        rigging = Rigging.fit(
            [shaped.posed(pose) for pose in poses],
            np.array(worn, np.float64),
            (derivatives_by_joint(dataset.take(row)) for row in rows),
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
        """Rig them at the stiffness that misses least; as `at`."""

        def tried() -> Iterator[Self]:
            for number, stiffness in enumerate(STIFFNESSES):
                yield cls.at(dataset, rows, model, anchors, stiffness)
                if progress:
                    progress("rigging", number + 1, len(STIFFNESSES))

        return min(tried(), key=lambda each: each.validation_mm)

    @cached_property
    def validation_mm(self) -> float:
        """Mean error on every fourth pose beside the anchors, which rigging does not learn from; where there are none,
        on each rigged anchor, told by the others.
        """
        anchors = self.anchors
        beside = list(zip(anchors.single_rotations[::VALIDATION_STEP], anchors.single_offsets[::VALIDATION_STEP], strict=True))
        missed = [self._error_mm(*each) for each in beside] or self._leave_one_out_mm()
        return float(np.mean(missed))

    def _leave_one_out_mm(self) -> list[float]:
        every, rigging, missed = np.arange(len(self.rotations)), self.rigging, []
        for anchor, rotations in enumerate(self.rotations):
            there = rigging.transforms[anchor], self.model.tables.rest, rigging.vertices[anchor]
            others = self.subset(np.delete(every, anchor))
            missed.append(others._error_mm(rotations, self.anchors.binding.offsets(*there)))
        return missed

    def _error_mm(self, rotations: Float[np.ndarray, "joints 4"], offsets: Float[np.ndarray, "verts 3"]) -> float:
        told = self(Pose(rotations, self.shaped.rest_pose.translation))
        return 1e3 * float(np.linalg.norm(told - offsets, axis=1).mean())

    def __call__(self, pose: Pose) -> Float[np.ndarray, "verts 3"]:
        """Offsets in a pose, on the mean shape [m]."""
        transforms = self.shaped.posed(pose).transforms
        worn = self.rigging.at(transforms, anchor_blend(self.model, self.rotations, pose))
        return self.anchors.binding.offsets(transforms, self.model.tables.rest, worn)

    def subset(self, some: Int[np.ndarray, " some"]) -> "RiggedAnchors":
        """Fewer anchors, at the same stiffness."""
        whole = self.rigging
        rigging = Rigging(whole.transforms[some], whole.vertices[some], whole.weights[some])
        return replace(self, rotations=self.rotations[some], rigging=rigging)
