"""Frames of a fit in the frame of the key joint, each independent of the others."""

from dataclasses import dataclass

import numpy as np

from hemline.arrays import Float, Int


@dataclass(frozen=True)
class KeyFrames:
    """Frames of all takes, without lead-ins."""

    displacements: Float[np.ndarray, "frames rows"]
    """Displacement of the vertices from rest in the key frame [m], float32; may be mapped from disk."""
    bones: Float[np.ndarray, "frames ins"]
    """Displacement of all bones from rest in the key frame [m], float32."""
    rope_bones: Float[np.ndarray, "frames ins"]
    """Displacement of the bones of simulated ropes from rest in the key frame [m], float32."""
    body: Float[np.ndarray, "frames body"]
    """Motion of the body (`body_inputs.body_inputs`), float32."""
    free: Float[np.ndarray, " ins"]
    """1 for coordinates of simulated bones, 0 for those that the body carries."""
    side: Int[np.ndarray, " frames"]
    """Side of the split: 0 train, 1 val, 2 test. Clips are never divided."""
    take: Int[np.ndarray, " frames"]
    """Number of the take of each frame; a mirror image counts as a take."""
    mark: str
    """Hash of everything that the frames depend on."""

    @property
    def vertex_count(self) -> int:
        return self.displacements.shape[1] // 3

    @property
    def train(self) -> Int[np.ndarray, " train"]:
        return np.flatnonzero(self.side == 0)

    @property
    def val(self) -> Int[np.ndarray, " val"]:
        return np.flatnonzero(self.side == 1)

    @property
    def test(self) -> Int[np.ndarray, " test"]:
        return np.flatnonzero(self.side == 2)
