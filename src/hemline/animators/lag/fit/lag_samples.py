"""Training samples of the lag network: features of vertices, and their displacements from skinning."""

from dataclasses import dataclass

import numpy as np

from hemline.animators.coarse.fit.garment_frames import GarmentFrames
from hemline.animators.coarse.fit.split_frames import SplitFrames
from hemline.arrays import Float, Int

Selection = np.ndarray | slice
"""Indices of frames or vertices."""
ALL = slice(None)
"""Selects everything."""


@dataclass(frozen=True, eq=False)
class GarmentSamples:
    """Some frames of one garment on one body; their arrays may be mapped from a file."""

    frames: GarmentFrames
    """All frames of the garment on the body."""
    rows: Int[np.ndarray, " frames"]
    """Indices of the frames that are samples."""

    def __len__(self) -> int:
        """Number of frames."""
        return len(self.rows)

    def features(self, frames: Selection = ALL, verts: Selection = ALL) -> Float[np.ndarray, "frames verts dynamic"]:
        """Returns the features of some vertices in some frames."""
        return self._some(self.frames.features, frames, verts)

    def turns(self, frames: Selection = ALL, verts: Selection = ALL) -> Float[np.ndarray, "frames verts 4"]:
        """Returns the rotations of vertices, which turn displacements out of their frames, wxyz."""
        return self._some(self.frames.turns, frames, verts)

    def displacements(self, frames: Selection = ALL, verts: Selection = ALL) -> Float[np.ndarray, "frames verts 3"]:
        """Returns the displacements of the truth from skinning, in the rotated frames of the vertices [m]."""
        return self._some(self.frames.displacements, frames, verts)

    def _some(self, array: np.ndarray, frames: Selection, verts: Selection) -> np.ndarray:
        return array[self.rows[frames]][:, verts].astype(np.float32)


def garment_samples(frames: SplitFrames, split: str) -> list[GarmentSamples]:
    """Returns the samples of one split (train, val or test), one entry per garment and body."""
    return [GarmentSamples(*each) for each in frames.part(split)]
