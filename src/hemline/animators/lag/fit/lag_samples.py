"""Frames of a garment as the lag network learns from them: features of vertices, and their way from skinning."""

from dataclasses import dataclass

import numpy as np

from hemline.animators.coarse.fit.split_frames import SplitFrames
from hemline.animators.coarse.fit.garment_frames import GarmentFrames
from hemline.arrays import Float, Int

Ends = np.ndarray | slice
ALL = slice(None)


@dataclass(frozen=True, eq=False)
class GarmentSamples:
    """Some frames of one garment on one body; their arrays may be mapped from a file."""

    worn: GarmentFrames
    rows: Int[np.ndarray, " frames"]
    """Which of its frames."""

    def __len__(self) -> int:
        """Number of frames."""
        return len(self.rows)

    def told(self, frames: Ends = ALL, verts: Ends = ALL) -> Float[np.ndarray, "frames verts dynamic"]:
        """Features of some vertices in some frames."""
        return self._some(self.worn.told, frames, verts)

    def turns(self, frames: Ends = ALL, verts: Ends = ALL) -> Float[np.ndarray, "frames verts 4"]:
        """How vertices are turned; takes displacements out of their frames."""
        return self._some(self.worn.turns, frames, verts)

    def apart(self, frames: Ends = ALL, verts: Ends = ALL) -> Float[np.ndarray, "frames verts 3"]:
        """Where the truth is, from where skinning puts each vertex, in its turned frame [m]."""
        return self._some(self.worn.apart, frames, verts)

    def _some(self, array: np.ndarray, frames: Ends, verts: Ends) -> np.ndarray:
        return array[self.rows[frames]][:, verts].astype(np.float32)


def garment_samples(frames: SplitFrames, side: str) -> list[GarmentSamples]:
    """The frames of one side, garment by garment and body by body."""
    return [GarmentSamples(*each) for each in frames.part(side)]
