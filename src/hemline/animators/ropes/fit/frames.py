"""The frames that a fit learns from: all in the key frame, each on its own."""

from dataclasses import dataclass

import numpy as np

from hemline.arrays import Float, Int


@dataclass(frozen=True)
class Frames:
    """Frames of all takes, lead-ins left out."""

    displacements: Float[np.ndarray, "frames rows"]
    """Displacement of the vertices from rest in the key frame [m], float32; may be mapped from disk."""
    bones: Float[np.ndarray, "frames ins"]
    """Displacement of all bones from rest in the key frame [m], float32."""
    rope_bones: Float[np.ndarray, "frames ins"]
    """The same, of simulated ropes."""
    free: Float[np.ndarray, " ins"]
    """1 for coordinates of simulated bones, 0 for those that the body carries."""
    side: Int[np.ndarray, " frames"]
    """0 train, 1 val, 2 test: by clip, never by frame."""
    mark: str
    """Hash of all that the frames depend on."""

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
