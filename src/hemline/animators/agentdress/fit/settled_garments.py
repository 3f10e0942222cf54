"""Settled garments on one body, and their offsets from the skinned garment."""

from dataclasses import dataclass

import numpy as np

from hemline.animators.agentdress.binding import Binding
from hemline.arrays import Float
from hemline.bodies.body import ShapedBody
from hemline.datasets.take import Take
from hemline.motions.motion import JOINT_COUNT, Pose


@dataclass(frozen=True)
class SettledGarments:
    """Settled garments on one body: joint rotations and skin transforms of each pose, and the garment in it [m]."""

    rotations: Float[np.ndarray, "poses joints 4"]
    transforms: Float[np.ndarray, "poses joints 3 4"]
    vertices: Float[np.ndarray, "poses verts 3"]

    @classmethod
    def of(cls, shaped: ShapedBody, takes: list[Take]) -> "SettledGarments":
        """Reads the garments of takes on a body."""
        poses: list[Pose] = [take.motion[0] for take in takes]
        return cls(
            np.array([pose.rotations for pose in poses], np.float64).reshape(-1, JOINT_COUNT, 4),
            np.array([shaped.posed(pose).transforms for pose in poses], np.float64).reshape(-1, JOINT_COUNT, 3, 4),
            np.array([take.vertices[0] for take in takes], np.float64),
        )

    def fit_rest(self, binding: Binding) -> Float[np.ndarray, " rows"]:
        """Finds the rest garment that, once skinned, is closest to these garments [m]."""
        return binding.fit_rest(self.transforms, self.vertices).ravel()

    def offsets(self, binding: Binding, rest: Float[np.ndarray, "verts 3"]) -> Float[np.ndarray, "poses verts 3"]:
        """Returns the offsets of each garment from the skinned `rest`, in rotated vertex frames [m]."""
        offsets = [
            binding.offsets(t, rest, vertices) for t, vertices in zip(self.transforms, self.vertices, strict=True)
        ]
        return np.array(offsets, np.float32).reshape(-1, *rest.shape)
