"""Settled garments on one body, and how far they are from what skinning carries along."""

from dataclasses import dataclass

import numpy as np

from hemline.animators.agentdress.binding import Binding
from hemline.arrays import Float
from hemline.bodies.body import ShapedBody
from hemline.datasets.take import Take
from hemline.motions.motion import JOINT_COUNT, Pose


@dataclass(frozen=True)
class SettledGarments:
    """Settled garments on one body: rotations and skin transforms of the poses, and what is worn there [m]."""

    rotations: Float[np.ndarray, "poses joints 4"]
    transforms: Float[np.ndarray, "poses joints 3 4"]
    vertices: Float[np.ndarray, "poses verts 3"]

    @classmethod
    def of(cls, shaped: ShapedBody, takes: list[Take]) -> "Settled":
        poses: list[Pose] = [take.motion[0] for take in takes]
        return cls(
            np.array([pose.rotations for pose in poses], np.float64).reshape(-1, JOINT_COUNT, 4),
            np.array([shaped.posed(pose).transforms for pose in poses], np.float64).reshape(-1, JOINT_COUNT, 3, 4),
            np.array([take.vertices[0] for take in takes], np.float64),
        )

    def fit_rest(self, binding: Binding) -> Float[np.ndarray, " rows"]:
        """The garment in the rest pose of the body that skinning carries nearest to these [m]."""
        return binding.fit_rest(self.transforms, self.vertices).ravel()

    def offsets(self, binding: Binding, rest: Float[np.ndarray, "verts 3"]) -> Float[np.ndarray, "poses verts 3"]:
        """How far each garment is from `rest`, carried along, in the turned frames of its binding [m]."""
        found = [binding.offsets(t, rest, worn) for t, worn in zip(self.transforms, self.vertices, strict=True)]
        return np.array(found, np.float32).reshape(-1, *rest.shape)
