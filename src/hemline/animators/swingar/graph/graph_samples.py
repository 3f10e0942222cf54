"""Frames of takes as the graph network is trained on them, numbered one after the other."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hemline.animators.swingar.features.proxy_on_body import BEGUN, STATIC
from hemline.animators.swingar.features.worn_frames import WornFrames
from hemline.arrays import Bool, Float, Int

from .graph_inputs import garment_of_frames, vertex_inputs
from .samples import FrameBatch, GarmentSample

SPREAD = 0.01
"""Features vary by this much at least, as they are scaled."""
SHOWN = 8
"""Frames of each garment that features are scaled by."""


@dataclass(frozen=True, eq=False)
class TakeSamples:
    """`samples.Samples` of takes. Arrays may be mapped from files: what is asked for is read then."""

    frames_of: Sequence[WornFrames]
    """Of each garment on a body."""
    trains: Sequence[Bool[np.ndarray, " frames"]]
    """Which of them are learned from; by the others the best weights are chosen."""
    descriptor: int
    """Numbers of the spectral descriptor."""

    @cached_property
    def garments(self) -> list[GarmentSample]:
        """All garments."""
        return [garment_of_frames(each, self.descriptor) for each in self.frames_of]

    @cached_property
    def firsts(self) -> Int[np.ndarray, " garments_and_one"]:
        """Number of the first sample of each garment, and of all samples."""
        return np.concatenate([[0], np.cumsum([len(each) for each in self.frames_of])]).astype(np.int64)

    @cached_property
    def garment_of(self) -> Int[np.ndarray, " samples"]:
        """Which garment each sample is of."""
        return np.repeat(np.arange(len(self.frames_of)), np.diff(self.firsts))

    @cached_property
    def before(self) -> Int[np.ndarray, "samples 2"]:
        """Samples one and two frames before each, where they are samples, too."""
        return np.concatenate(
            [first + each.before for first, each in zip(self.firsts[:-1], self.frames_of, strict=True)]
        )

    @cached_property
    def training(self) -> Int[np.ndarray, " training"]:
        """Samples to train on."""
        return np.flatnonzero(np.concatenate(self.trains))

    @cached_property
    def wanted(self) -> Bool[np.ndarray, " samples"]:
        """Whether the two frames before a sample are samples, too."""
        return np.concatenate([np.asarray(each.wanted) for each in self.frames_of])

    @cached_property
    def validation(self) -> Int[np.ndarray, " validation"]:
        """Samples to choose the best weights by."""
        return np.flatnonzero(~np.concatenate(self.trains) & self.wanted)

    @cached_property
    def missed(self) -> Float[np.ndarray, " garments"]:
        """How far skinning misses each garment that is learned from, mean distance [m]; nan of the others."""
        return np.array(
            [
                np.linalg.norm(np.asarray(each.apart[mine], np.float32), axis=2).mean() if mine.any() else np.nan
                for each, mine in zip(self.frames_of, self.trains, strict=True)
            ]
        )

    def frames(self, chosen: Int[np.ndarray, " frames"]) -> FrameBatch:
        """Some samples, all of one garment."""
        number = int(self.garment_of[chosen[0]])
        worn, rows = self.frames_of[number], chosen - self.firsts[number]
        return FrameBatch(
            worn.motion[rows].astype(np.float32),
            np.array(worn.transforms[rows]),
            np.array(worn.joints[rows]),
            np.array(worn.body[rows]),
            np.array(worn.heading[rows]),
            np.array(worn.truth[rows]),
            vertex_inputs(worn.told[rows], worn.static),
            worn.turns[rows].astype(np.float32),
        )

    @cached_property
    def scales(self) -> tuple[Float[np.ndarray, " told"], Float[np.ndarray, " told"]]:
        """Mean and spread of each feature of the vertices over frames that are learned from, float32."""
        sums, squares, count = 0.0, 0.0, 0
        for each, mine in zip(self.frames_of, self.trains, strict=True):
            rows = np.flatnonzero(mine)
            rows = rows[:: max(1, len(rows) // SHOWN)]
            if len(rows):
                told = vertex_inputs(each.told[rows], each.static).astype(np.float64)
                sums = sums + told.sum(axis=(0, 1))
                squares = squares + (told**2).sum(axis=(0, 1))
                count += told.shape[0] * told.shape[1]
        mean = sums / count
        spread = np.sqrt(np.maximum(squares / count - mean**2, 0))
        return mean.astype(np.float32), np.where(spread < 1e-4, 1, np.maximum(spread, SPREAD)).astype(np.float32)


def forget_beginning(told: Float[np.ndarray, "... told"]) -> None:
    """Take from features what they tell of how the garment lay at the beginning, in place."""
    told[..., -STATIC - BEGUN : -STATIC] = 0
