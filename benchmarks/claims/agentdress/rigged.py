"""Sensitivity-optimised rigging as a pose model: its stiffness chosen on poses beside the anchors."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from pose_models import Offsets, blend_of

from hemline import bodies
from hemline.animators.agentdress.anchor_set import AnchorSet, is_t_pose
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.animators.agentdress.rigging import Rigging
from hemline.arrays import Float, Int
from hemline.bodies.body import ShapedBody
from hemline.datasets import Dataset
from hemline.datasets.joint_sensitivity import derivatives_by_joint
from hemline.motions.motion import Pose

STIFFNESSES = (1e-4, 1e-3, 1e-2, 1.0)
"""Of the weights, over what all derivatives cost."""

EVERY = 4
"""Of the poses beside the anchors, so many-th is used to choose."""


@dataclass(frozen=True, eq=False)
class Rigged:
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
    def at(cls, dataset: Dataset, model: AnimatorAgentDress, anchors: AnchorSet, stiffness: float) -> Self | None:
        """Rig them at one stiffness; None where fewer than two have derivatives (`hemline drape --derivatives`)."""
        shaped = bodies.load(model.body_name).shaped()
        takes = [dataset.take(row) for row in dataset.anchors() if not any(row.betas)]
        takes = [take for take in takes if "turn.0.0" in take.derivatives and not is_t_pose(take.motion[0])]
        if len(takes) < 2:
            return None
        poses = [take.motion[0] for take in takes]
        rigging = Rigging.fitted(
            [shaped.posed(pose) for pose in poses],
            np.array([take.vertices[0] for take in takes], np.float64),
            [derivatives_by_joint(take) for take in takes],
            anchors.binding.shares(),
            stiffness,
        )
        rotations = np.array([pose.rotations for pose in poses], np.float64)
        return cls(model, anchors, shaped, rotations, rigging, stiffness)

    @classmethod
    def fitted(cls, dataset: Dataset, model: AnimatorAgentDress, anchors: AnchorSet) -> Self | None:
        """Rig them at the stiffness that misses least; None as `at`."""
        found = [cls.at(dataset, model, anchors, stiffness) for stiffness in STIFFNESSES]
        return min((each for each in found if each), key=lambda each: each.validation_mm, default=None)

    @cached_property
    def validation_mm(self) -> float:
        """Mean error on every fourth pose beside the anchors, which rigging does not learn from."""
        rest, anchors = self.shaped.rest_pose.translation, self.anchors
        some = zip(anchors.single_rotations[::EVERY], anchors.single_offsets[::EVERY], strict=True)
        return 1e3 * float(
            np.mean([np.linalg.norm(self(Pose(turned, rest)) - offsets, axis=1).mean() for turned, offsets in some])
        )

    def __call__(self, pose: Pose) -> Offsets:
        """Offsets in a pose, on the mean shape [m]."""
        transforms = self.shaped.posed(pose).transforms
        worn = self.rigging.at(transforms, blend_of(self.model, self.rotations, pose))
        return self.anchors.binding.offsets(transforms, self.model.tables.rest, worn)

    def only(self, some: Int[np.ndarray, " some"]) -> "Rigged":
        """Fewer anchors, at the same stiffness."""
        whole = self.rigging
        rigging = Rigging(whole.transforms[some], whole.worn[some], whole.weights[some])
        return replace(self, rotations=self.rotations[some], rigging=rigging)
