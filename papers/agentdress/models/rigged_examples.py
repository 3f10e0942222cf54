"""Examples of sensitivity-optimised rigging, and the garments that some of them predict in other poses."""

import numpy as np

from hemline.animators.agentdress.fit.anchor_set import AnchorSet
from hemline.animators.agentdress.fit.rigged_anchors import RiggedAnchors, anchor_blend, rows_with_derivatives
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.animators.agentdress.sor.rigging import relative_transforms, skin_points
from hemline.arrays import Float, Int, Vertices
from hemline.datasets import Dataset
from hemline.motions.motion import Pose
from papers.agentdress.settled.residual import Residual, ResidualSize

STIFFNESS = 1e-2
"""Cost of changing the skin weights; fixed, as `RiggedAnchors.search` would rig all anchors once per candidate."""

Chosen = Int[np.ndarray, " chosen"]


def rig_anchors(dataset: Dataset, model: AnimatorAgentDress, anchors: AnchorSet) -> RiggedAnchors:
    """Rigs all anchors that have derivatives, with one stiffness.

    Args:
        dataset: The dataset of the anchors.
        model: A model fitted to it.
        anchors: The anchors read from it.
    """
    return RiggedAnchors.rig(dataset, rows_with_derivatives(dataset), model, anchors, STIFFNESS)


class Examples:
    """Predictions of the garment in given poses from some of the examples."""

    def __init__(self, model: AnimatorAgentDress, rigged: RiggedAnchors, poses: list[Pose]):
        shaped, rigging = rigged.shaped, rigged.rigging
        self.model, self.rotations, self.poses = model, rigged.rotations, poses
        self.posed = [shaped.posed(pose) for pose in poses]
        self.residual = Residual(model.garment, shaped)
        parts = list(zip(rigging.transforms, rigging.weights, rigging.vertices, strict=True))
        self.skinned = [
            np.array(
                [
                    skin_points(relative_transforms(posed.transforms, transforms), weights, vertices)
                    for transforms, weights, vertices in parts
                ],
                np.float32,
            )
            for posed in self.posed
        ]

    def predict(self, number: int, chosen: Chosen) -> Vertices:
        """Predicts the garment in one of the poses from the chosen examples [m]."""
        blend = anchor_blend(self.model, self.rotations[chosen], self.poses[number]).astype(np.float32)
        return np.einsum("va,avi->vi", blend, self.skinned[number][chosen])

    def residual_of(self, number: int, vertices: Vertices) -> ResidualSize:
        """Measures the residual of a garment in one of the poses, after moving it out of the body."""
        out, pinched = self.residual.push_out(self.posed[number], vertices)
        return self.residual.measure(self.posed[number], out, pinched)

    def norms(self, chosen: Chosen) -> Float[np.ndarray, " poses"]:
        """Returns the norm of the residual of the prediction in each pose [N]; 0 in the poses of chosen examples."""
        others = np.setdiff1d(np.arange(len(self.poses)), chosen)
        result = np.zeros(len(self.poses))
        result[others] = [self.residual_of(number, self.predict(number, chosen)).norm for number in others]
        return result
