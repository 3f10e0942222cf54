"""The simulated bones of all takes, frame after frame: the training set of recurrent networks."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from hemline.animators.ropes.bones.body_inputs import BodyAtRest
from hemline.animators.ropes.bones.bones import rest_bones
from hemline.animators.ropes.bones.chains import Ropes
from hemline.animators.ropes.fit.gather import TakeFrames
from hemline.arrays import Float, Int
from hemline.learning.mirror import mirror_of, mirror_transforms, mirror_vertices

from .motion_inputs import MOTION_INPUT_COUNT, motion_inputs

STANDING_SECONDS = 10.0
"""Time that each body shape stands still in the training set, so that networks learn the drape at rest [s]."""


@dataclass(frozen=True)
class Sequences:
    """Frames of all takes one after the other, lead-ins included; the first two of each take have no inputs."""

    body: Float[np.ndarray, "frames ins"]
    """`motion_inputs` of the step to each frame, float32."""
    bones: Float[np.ndarray, "frames free 3"]
    """Displacements of the simulated bones from rest in the key frame [m], float32."""
    first: Int[np.ndarray, " frames"]
    """First frame of the take of each frame."""
    last: Int[np.ndarray, " frames"]
    """Last frame of the take of each frame."""
    side: Int[np.ndarray, " frames"]
    """0 train, 1 val, 2 test."""
    dt: float
    """Time between frames [s]."""

    @property
    def longest(self) -> int:
        """Largest number of steps from a frame of a take to train on."""
        trained = self.side == 0
        return int((self.last[trained] - self.first[trained]).max(initial=0)) - 2

    def windows(self, side: int, length: int) -> Int[np.ndarray, " windows"]:
        """Returns the frames of one side with two frames before and `length` frames after them."""
        frames = np.arange(len(self.side))
        here = (self.side == side) & (frames - self.first >= 2) & (frames + length <= self.last)
        return frames[here]


def sequences(source: TakeFrames, ropes: Ropes, *, mirror: bool) -> Sequences:
    """Gathers the bones of all takes, of mirror images of those to train on, and of bodies at rest.

    Args:
        source: The takes.
        ropes: The bones.
        mirror: Add mirror images of the takes to train on, where garment and body are symmetric.
    """
    partner = mirror_of(source.dataset.garment, source.shaped[0]) if mirror else None
    free = np.flatnonzero(ropes.parents >= 0)
    rests = [rest_bones(ropes, rest, shaped)[free] for rest, shaped in zip(source.rests, source.shaped, strict=True)]
    at_rest = [BodyAtRest(ropes.key_index, np.asarray(shaped.joints, np.float64)) for shaped in source.shaped]
    columns, first, dt = [], 0, 1 / 30
    for bones, transforms, side, shape, dt in _training_clips(source, ropes, free, partner):
        count, keys = len(bones), transforms[:, ropes.key_index]
        body = np.zeros((count, MOTION_INPUT_COUNT), np.float32)
        body[2:] = motion_inputs(at_rest[shape], transforms[:-2], transforms[1:-1], transforms[2:], dt)
        placed = (bones - keys[:, None, :, 3]) @ keys[:, :, :3] - rests[shape]
        full = [np.full(count, each, np.int32) for each in (first, first + count - 1, side)]
        columns.append((body, placed.astype(np.float32), *full))
        first += count
    return Sequences(*(np.concatenate(each) for each in zip(*columns, strict=True)), dt)


def _training_clips(
    source: TakeFrames, ropes: Ropes, free: np.ndarray, partner: np.ndarray | None
) -> Iterator[tuple[np.ndarray, Float[np.ndarray, "frames joints 3 4"], int, int, float]]:
    """Yields bones, transforms, side, shape and time step of each take; then those of the bodies at rest."""
    dt = 1 / 30
    for take, side, shape in source.takes():
        dt, shaped = 1 / take.motion.fps, source.shaped[shape]
        transforms = shaped.transforms_of(take.motion.rotations, take.motion.translations)[0].astype(np.float64)
        yield ropes.positions_on(take.vertices)[:, free], transforms, side, shape, dt
        if partner is not None and side == 0:
            bones = ropes.positions_on(mirror_vertices(take.vertices, partner))[:, free]
            yield bones, mirror_transforms(transforms), side, shape, dt
    for shape, (rest, shaped) in enumerate(zip(source.rests, source.shaped, strict=True)):
        count = round(STANDING_SECONDS / dt)
        still = shaped.posed(shaped.rest_pose).transforms.astype(np.float64)
        bones = np.tile(ropes.positions_on(rest)[free], (count, 1, 1))
        yield bones, np.tile(still, (count, 1, 1, 1)), 0, shape, dt
