"""Examples of sensitivity-optimised rigging: all that have derivatives, and what some of them tell in other poses."""

import numpy as np
from pose_models import blend_of
from residual import Residual
from rigged import Rigged

from hemline import bodies
from hemline.animators.agentdress.anchor_set import AnchorSet, is_t_pose
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.animators.agentdress.rigging import Rigging, relative, skin
from hemline.arrays import Float, Int, Vertices
from hemline.datasets import Dataset
from hemline.datasets.joint_sensitivity import derivatives_by_joint
from hemline.motions.motion import Pose

STIFFNESS = 1e-2
"""What a change of the skin weights costs; `Rigged.fitted` chooses among some, at four times the cost."""

Chosen = Int[np.ndarray, " chosen"]


def rigged_at(dataset: Dataset, model: AnimatorAgentDress, anchors: AnchorSet) -> Rigged:
    """All anchors that have derivatives, rigged at one stiffness.

    Args:
        dataset: Of the anchors.
        model: Fitted to them.
        anchors: Read from it.
    """
    shaped = bodies.load(model.body_name).shaped()
    takes = [dataset.take(row) for row in dataset.anchors() if not any(row.betas)]
    takes = [take for take in takes if "turn.0.0" in take.derivatives and not is_t_pose(take.motion[0])]
    if len(takes) < 2:
        raise SystemExit("fewer than two anchors have derivatives: run 'hemline drape' with --derivatives")
    poses = [take.motion[0] for take in takes]
    rigging = Rigging.fitted(
        [shaped.posed(pose) for pose in poses],
        np.array([take.vertices[0] for take in takes], np.float64),
        [derivatives_by_joint(take) for take in takes],
        anchors.binding.shares(),
        STIFFNESS,
    )
    rotations = np.array([pose.rotations for pose in poses], np.float64)
    return Rigged(model, anchors, shaped, rotations, rigging, STIFFNESS, float("nan"))


class Examples:
    """Garments guessed in some poses from some of the examples."""

    def __init__(self, model: AnimatorAgentDress, rigged: Rigged, poses: list[Pose]):
        shaped, fitted = rigged.shaped, rigged.rigging
        self.model, self.rotations, self.poses = model, rigged.rotations, poses
        self.posed = [shaped.posed(pose) for pose in poses]
        self.residual = Residual(model.garment, shaped)
        self.skinned = [
            np.array(
                [
                    skin(relative(posed.transforms, transforms), weights, worn)
                    for transforms, weights, worn in zip(fitted.transforms, fitted.weights, fitted.worn, strict=True)
                ],
                np.float32,
            )
            for posed in self.posed
        ]

    def guessed(self, number: int, chosen: Chosen) -> Vertices:
        """The garment in one of the poses, from the chosen examples [m]."""
        blend = blend_of(self.model, self.rotations[chosen], self.poses[number]).astype(np.float32)
        return np.einsum("va,avi->vi", blend, self.skinned[number][chosen])

    def left(self, number: int, worn: Vertices) -> float:
        """The force that is left on a garment in one of the poses, once it is out of the body [N]."""
        out, pinched = self.residual.pushed_out(self.posed[number], worn)
        return self.residual.norm(self.posed[number], out, pinched)

    def all_left(self, chosen: Chosen) -> Float[np.ndarray, " poses"]:
        """The same of all poses, from the chosen examples [N]."""
        return np.array([self.left(number, self.guessed(number, chosen)) for number in range(len(self.poses))])
