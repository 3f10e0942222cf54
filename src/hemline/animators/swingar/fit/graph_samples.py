"""Frames of takes as the graph network is trained on them, numbered one after the other."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from hemline import bodies
from hemline.animators.coarse.fit.garment_frames import GarmentFrames
from hemline.animators.coarse.proxy_on_body import BEGINNING_COUNT, STATIC_COUNT
from hemline.animators.swingar.graph_inputs import TOLD, garment_of_frames, vertex_inputs
from hemline.arrays import Bool, Float, Int
from hemline.bodies import Body, PosedBody
from hemline.collide.neural_sdf.distance import Distance
from hemline.collide.neural_sdf.neural_sdf import load_neural_sdf
from hemline.motions.motion import JOINT_COUNT, Pose
from hemline.motions.quaternions import from_axis_angle

from .samples import FrameBatch, GarmentSample

SPREAD = 0.01
"""Features vary by this much at least, as they are scaled."""
SHOWN = 8
"""Frames of each garment that features are scaled by."""


@dataclass(frozen=True, eq=False)
class TakeSamples:
    """`samples.Samples` of takes. Arrays of frames may be mapped from files: what is asked for is read then."""

    worn: Sequence[GarmentFrames]
    """The frames of each garment on a body."""
    garments: Sequence[GarmentSample]
    """The garments."""
    firsts: Int[np.ndarray, " garments"]
    """Number of the first sample of each."""
    garment_of: Int[np.ndarray, " samples"]
    """Which garment each sample is of."""
    before: Int[np.ndarray, "samples 2"]
    """Samples one and two frames before each; the sample itself where they are not among them."""
    wanted: Bool[np.ndarray, " samples"]
    """Whether they are, or it is at the beginning of its clip."""
    training: Int[np.ndarray, " training"]
    """Samples to train on."""
    validation: Int[np.ndarray, " validation"]
    """Samples to choose the best weights by."""
    missed: Float[np.ndarray, " garments"]
    """How far skinning misses each garment that is learned from, mean distance [m]; nan of the others."""

    @classmethod
    def of(cls, worn: Sequence[GarmentFrames], trains: Sequence[Bool[np.ndarray, " frames"]], descriptor: int) -> Self:
        """Frames as samples.

        Args:
            worn: The frames of each garment on a body.
            trains: Which of them are learned from; by the others the best weights are chosen.
            descriptor: Numbers of the spectral descriptor.
        """
        counts = [len(each) for each in worn]
        firsts = np.cumsum([0, *counts])[:-1].astype(np.int64)
        wanted, learned = np.concatenate([np.asarray(each.wanted) for each in worn]), np.concatenate(trains)
        return cls(
            worn,
            [garment_of_frames(each, descriptor) for each in worn],
            firsts,
            np.repeat(np.arange(len(worn)), counts),
            np.concatenate([first + each.before for first, each in zip(firsts, worn, strict=True)]),
            wanted,
            np.flatnonzero(learned),
            np.flatnonzero(~learned & wanted),
            np.array([_missed(each, np.flatnonzero(mine)) for each, mine in zip(worn, trains, strict=True)]),
        )

    def frames(self, chosen: Int[np.ndarray, " frames"]) -> FrameBatch:
        """Some samples, all of one garment."""
        worn, rows = self._rows(chosen)
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

    def bodies(self, garment: int, batch: FrameBatch) -> list[Distance]:
        """The neural distance to the body in each frame, as the frame sees it; raises BadModel."""
        body, sdf = bodies.load(self.worn[garment].body_name), load_neural_sdf()
        return [sdf.at(_posed(body, told)) for told in batch.body]

    def skinned(self, chosen: Int[np.ndarray, " frames"]) -> float:
        """Mean distance of some samples, all of one garment, from skinning [m]."""
        return _missed(*self._rows(chosen))

    def scales(self) -> tuple[Float[np.ndarray, " told"], Float[np.ndarray, " told"]]:
        """Mean and spread of each feature of the vertices over frames that are learned from, float32."""
        sums, squares, count = np.zeros(TOLD), np.zeros(TOLD), 0
        for number in np.unique(self.garment_of[self.training]):
            chosen = self.training[self.garment_of[self.training] == number]
            worn, rows = self._rows(chosen[:: max(1, len(chosen) // SHOWN)])
            told = vertex_inputs(worn.told[rows], worn.static).astype(np.float64)
            sums, squares = sums + told.sum(axis=(0, 1)), squares + (told**2).sum(axis=(0, 1))
            count += told.shape[0] * told.shape[1]
        mean = sums / count
        spread = np.sqrt(np.maximum(squares / count - mean**2, 0))
        return mean.astype(np.float32), np.where(spread < 1e-4, 1, np.maximum(spread, SPREAD)).astype(np.float32)

    def _rows(self, chosen: Int[np.ndarray, " frames"]) -> tuple[GarmentFrames, Int[np.ndarray, " frames"]]:
        number = int(self.garment_of[chosen[0]])
        return self.worn[number], chosen - self.firsts[number]


def _missed(worn: GarmentFrames, rows: Int[np.ndarray, " frames"]) -> float:
    """Mean distance from skinning [m]; nan of no frames."""
    if not len(rows):
        return float("nan")
    return float(np.linalg.norm(worn.apart[rows].astype(np.float32), axis=2).mean())


def _posed(body: Body, told: Float[np.ndarray, " body"]) -> PosedBody:
    """The body as a frame sees it: the pelvis is the origin, its heading is taken out."""
    betas, axes = np.split(told, [-3 * JOINT_COUNT])
    rotations = from_axis_angle(axes.reshape(JOINT_COUNT, 3).astype(np.float64)).astype(np.float32)
    return body.shaped(betas).posed(Pose(rotations, np.zeros(3, np.float32)))


def forget_beginning(told: Float[np.ndarray, "... told"]) -> None:
    """Take from features what they tell of how the garment lay at the beginning, in place."""
    told[..., -STATIC_COUNT - BEGINNING_COUNT : -STATIC_COUNT] = 0
