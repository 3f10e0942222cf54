"""Examples of sensitivity-optimised rigging: all that have derivatives, and what some of them tell in other poses."""

import numpy as np

from hemline.animators.agentdress.fit.anchor_set import AnchorSet
from hemline.animators.agentdress.fit.rigged_anchors import RiggedAnchors, anchor_blend, rows_with_derivatives
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.animators.agentdress.sor.rigging import relative_transforms, skin_points
from hemline.arrays import Float, Int, Vertices
from hemline.datasets import Dataset
from hemline.motions.motion import Pose
from papers.agentdress.residual import Left, Residual

STIFFNESS = 1e-2
"""What a change of the skin weights costs; `RiggedAnchors.fitted` chooses among some, at the cost of each."""

Chosen = Int[np.ndarray, " chosen"]


def rigged_at(dataset: Dataset, model: AnimatorAgentDress, anchors: AnchorSet) -> RiggedAnchors:
    """All anchors that have derivatives, rigged at one stiffness.

    Args:
        dataset: Of the anchors.
        model: Fitted to them.
        anchors: Read from it.
    """
    return RiggedAnchors.at(dataset, rows_with_derivatives(dataset), model, anchors, STIFFNESS)


class Examples:
    """Garments guessed in some poses from some of the examples."""

    def __init__(self, model: AnimatorAgentDress, rigged: RiggedAnchors, poses: list[Pose]):
        shaped, fitted = rigged.shaped, rigged.rigging
        self.model, self.rotations, self.poses = model, rigged.rotations, poses
        self.posed = [shaped.posed(pose) for pose in poses]
        self.residual = Residual(model.garment, shaped)
        self.skinned = [
            np.array(
                [
                    skin_points(relative_transforms(posed.transforms, transforms), weights, worn)
                    for transforms, weights, worn in zip(fitted.transforms, fitted.weights, fitted.vertices, strict=True)
                ],
                np.float32,
            )
            for posed in self.posed
        ]

    def guessed(self, number: int, chosen: Chosen) -> Vertices:
        """The garment in one of the poses, from the chosen examples [m]."""
        blend = anchor_blend(self.model, self.rotations[chosen], self.poses[number]).astype(np.float32)
        return np.einsum("va,avi->vi", blend, self.skinned[number][chosen])

    def left(self, number: int, worn: Vertices) -> Left:
        """What is left on a garment in one of the poses, once it is out of the body."""
        out, pinched = self.residual.pushed_out(self.posed[number], worn)
        return self.residual.left(self.posed[number], out, pinched)

    def norms(self, chosen: Chosen) -> Float[np.ndarray, " poses"]:
        """Norms of the residual in all poses that are no examples, guessed from the chosen ones; 0 in those [N]."""
        others = np.setdiff1d(np.arange(len(self.poses)), chosen)
        result = np.zeros(len(self.poses))
        result[others] = [self.left(number, self.guessed(number, chosen)).norm for number in others]
        return result
