"""Eq. 3 and 4 of AgentDress near an anchor: with simulated garments as its terms, and with the models."""

import numpy as np

from hemline import bodies
from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.fit.anchor_set import AnchorSet
from hemline.animators.agentdress.fit.rigged_anchors import anchor_blend
from hemline.animators.agentdress.fit.shape_fit import shape_models
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.arrays import Float, Transforms, Vertices
from hemline.datasets import Dataset
from hemline.motions.motion import Pose
from papers.agentdress.rigged_examples import rigged_at

Worn = Float[np.ndarray, "verts 3"]


class Synthesis:
    """All ways to guess the garment in a pose on a shape from an anchor on the mean shape nearby.

    Skinning is the library's: what a garment is beside its skinned rest garment is kept in the turned frames of the
    vertices, and one binding serves all shapes.
    """

    def __init__(self, model: AnimatorAgentDress, dataset: Dataset, anchors: AnchorSet):
        self.model, self.anchors, self.body = model, anchors, bodies.load(model.body_name)
        self.rigged = rigged_at(dataset, model, anchors)
        self.effects = shape_models(anchors, AgentDressConfig())

    def all(
        self, anchor: Pose, pose: Pose, betas: tuple[float, ...], at_anchor: Worn, posed: Worn, shaped: Worn
    ) -> dict[str, Vertices]:
        """Guesses by name, in the world [m].

        Args:
            anchor: The anchor's pose.
            pose: The pose to guess in.
            betas: The shape to guess on.
            at_anchor: The garment settled in the anchor's pose on the mean shape: f(b0, t0) [m].
            posed: In the pose on the mean shape: f(b0, t) [m].
            shaped: In the anchor's pose on the shape: f(b, t0) [m].
        """
        at_anchor, posed = self._beside(anchor, (), at_anchor), self._beside(pose, (), posed)
        change = self._beside(anchor, betas, shaped) - at_anchor
        return {
            "theoretical": self._worn(pose, betas, posed + change),
            "practical": self.model.settled(self.body.shaped(np.asarray(betas, np.float32)).posed(pose)),
            "practical, rigging": self._worn(pose, betas, self.rigged(pose) + self._change(pose, betas)),
            "the anchor, skinned": self._worn(pose, betas, at_anchor),
        }

    def _change(self, pose: Pose, betas: tuple[float, ...]) -> Worn:
        """What the shape adds, blended over the nearest anchors (Eq. 4)."""
        weights = anchor_blend(self.model, self.anchors.rotations, pose)
        each = np.array([self._known(betas)])
        zero = np.zeros_like(each)
        total = np.zeros((len(weights), 3))
        for anchor in np.flatnonzero(weights.any(axis=0)):
            made = self.effects[anchor]
            total += weights[:, anchor, None] * (made.at(each) - made.at(zero)).reshape(-1, 3)
        return total

    def _known(self, betas: tuple[float, ...]) -> Float[np.ndarray, " betas"]:
        return np.pad(np.asarray(betas, np.float64), (0, self.anchors.betas.shape[1] - len(betas)))

    def _rest(self, betas: tuple[float, ...]) -> Worn:
        return self.anchors.rest.at(self._known(betas)[None]).reshape(-1, 3)

    def _transforms(self, pose: Pose, betas: tuple[float, ...]) -> Transforms:
        return self.body.shaped(np.asarray(betas, np.float32)).posed(pose).transforms

    def _beside(self, pose: Pose, betas: tuple[float, ...], worn: Worn) -> Worn:
        """How far a garment is from its skinned rest garment, in the turned frames of its vertices [m]."""
        return self.anchors.binding.offsets(self._transforms(pose, betas), self._rest(betas), worn.astype(np.float64))

    def _worn(self, pose: Pose, betas: tuple[float, ...], offsets: Worn) -> Worn:
        return self.anchors.binding.skin(self._transforms(pose, betas), self._rest(betas), offsets)
