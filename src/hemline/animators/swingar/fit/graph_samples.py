"""Training samples of the graph network: numbered frames of takes."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Self

import numpy as np
import torch
from torch import Tensor

from hemline.animators.coarse.fit.garment_frames import GarmentFrames
from hemline.animators.swingar.garment_sample import GarmentSample
from hemline.animators.swingar.graph_inputs import VERTEX, garment_sample, vertex_inputs
from hemline.arrays import Bool, Float, Int
from hemline.learning.fit.body_distance import BodyDistance
from hemline.motions.motion import JOINT_COUNT

from .frame_batch import FrameBatch
from .frame_tensors import FrameTensors

MIN_SPREAD = 0.01
"""Smallest spread by which features are divided."""
SCALE_FRAMES = 8
"""Number of frames of each garment from which the scales of features are computed."""


@dataclass(frozen=True, eq=False)
class TakeSamples:
    """`samples.TrainingSamples` of takes. Arrays of frames may be mapped from files: what is asked for is read then."""

    groups: Sequence[GarmentFrames]
    """The frames of each garment on a body."""
    garments: Sequence[GarmentSample]
    """The garments at rest."""
    firsts: Int[np.ndarray, " garments"]
    """Number of the first sample of each garment."""
    garment_of: Int[np.ndarray, " samples"]
    """Number of the garment of each sample."""
    before: Int[np.ndarray, "samples 2"]
    """Samples one and two frames before each; the sample itself if such a frame is missing."""
    has_past: Bool[np.ndarray, " samples"]
    """Whether the two frames before a sample are samples too."""
    training: Int[np.ndarray, " training"]
    """Samples to train on."""
    validation: Int[np.ndarray, " validation"]
    """Samples by which the best weights are chosen."""
    skinning_errors: Float[np.ndarray, " garments"]
    """Mean distance of each garment that is trained on from skinning [m]; nan for the others."""

    @classmethod
    def of(
        cls, groups: Sequence[GarmentFrames], trains: Sequence[Bool[np.ndarray, " frames"]], descriptor: int
    ) -> Self:
        """Numbers frames as samples.

        Args:
            groups: The frames of each garment on a body.
            trains: Whether each frame is trained on. The best weights are chosen by the others.
            descriptor: Number of entries of the spectral descriptor.
        """
        counts = [len(each) for each in groups]
        firsts = np.cumsum([0, *counts])[:-1].astype(np.int64)
        wanted = [np.asarray(each.wanted) for each in groups]
        learned = [own & each for own, each in zip(trains, wanted, strict=True)]
        held_out = [~own & each for own, each in zip(trains, wanted, strict=True)]
        return cls(
            groups,
            [_sample_of(each, descriptor) for each in groups],
            firsts,
            np.repeat(np.arange(len(groups)), counts),
            np.concatenate([first + each.before for first, each in zip(firsts, groups, strict=True)]),
            np.concatenate([each.has_past for each in groups]),
            np.flatnonzero(np.concatenate(learned)),
            np.flatnonzero(np.concatenate(held_out)),
            np.array([_skinning_error(each, np.flatnonzero(mine)) for each, mine in zip(groups, learned, strict=True)]),
        )

    def frames(self, chosen: Int[np.ndarray, " frames"]) -> FrameBatch:
        """Returns some samples, all of one garment."""
        group, rows = self._rows(chosen)
        return FrameBatch(
            group.motion[rows].astype(np.float32),
            np.array(group.transforms[rows]),
            np.array(group.joints[rows]),
            np.array(group.body[rows]),
            np.array(group.heading[rows]),
            np.array(group.truth[rows]),
            vertex_inputs(group.features[rows], group.static),
            group.turns[rows].astype(np.float32),
        )

    def heights(self, garment: int, vertices: Tensor, frames: FrameTensors) -> Tensor:
        """Returns the signed distances of predicted vertices to the body, see `TrainingSamples.heights`."""
        distance = _body_distance(self.groups[garment], vertices.device)
        axes = frames.body[:, -3 * JOINT_COUNT :].unflatten(1, (JOINT_COUNT, 3))
        return distance.distances(vertices, frames.transforms, axes)

    def skinning_error(self, chosen: Int[np.ndarray, " frames"]) -> float:
        """Returns the mean distance of some samples, all of one garment, from skinning [m]."""
        return _skinning_error(*self._rows(chosen))

    def scales(self) -> tuple[Float[np.ndarray, " features"], Float[np.ndarray, " features"]]:
        """Returns mean and spread of each feature of the vertices over frames that are trained on, float32."""
        sums, squares, count = np.zeros(VERTEX.count), np.zeros(VERTEX.count), 0
        for number in np.unique(self.garment_of[self.training]):
            chosen = self.training[self.garment_of[self.training] == number]
            group, rows = self._rows(chosen[:: max(1, len(chosen) // SCALE_FRAMES)])
            features = vertex_inputs(group.features[rows], group.static).astype(np.float64)
            sums, squares = sums + features.sum(axis=(0, 1)), squares + (features**2).sum(axis=(0, 1))
            count += features.shape[0] * features.shape[1]
        mean = sums / count
        spread = np.sqrt(np.maximum(squares / count - mean**2, 0))
        return mean.astype(np.float32), np.where(spread < 1e-4, 1, np.maximum(spread, MIN_SPREAD)).astype(np.float32)

    def _rows(self, chosen: Int[np.ndarray, " frames"]) -> tuple[GarmentFrames, Int[np.ndarray, " frames"]]:
        number = int(self.garment_of[chosen[0]])
        return self.groups[number], chosen - self.firsts[number]


def _sample_of(frames: GarmentFrames, descriptor: int) -> GarmentSample:
    """Returns the garment of some frames at rest."""
    faces, *parts = (np.array(each) for each in (frames.faces, frames.cut, frames.fit, frames.skin, frames.mass))
    return garment_sample(faces, *parts, descriptor=descriptor)


def _skinning_error(group: GarmentFrames, rows: Int[np.ndarray, " frames"]) -> float:
    """Returns the mean distance of some frames from skinning [m], nan if there are none."""
    if not len(rows):
        return float("nan")
    return float(np.linalg.norm(group.displacements[rows].astype(np.float32), axis=2).mean())


@lru_cache(maxsize=1024)
def _body_distance(group: GarmentFrames, device: torch.device) -> BodyDistance:
    """Returns the neural distance to the body of some frames."""
    betas = np.asarray(group.body[0][: -3 * JOINT_COUNT])
    return BodyDistance(group.on_body.shaped(betas), device)
