"""A training set by formula: sheets that hang from a body which slides to and fro, and sway after it."""

from dataclasses import dataclass

import numpy as np
from torch import Tensor

from hemline.animators.swingar.fit.frame_batch import FrameBatch
from hemline.animators.swingar.fit.frame_tensors import FrameTensors
from hemline.animators.swingar.garment_sample import GarmentSample
from hemline.animators.swingar.graph import Graph
from hemline.meshes import vertex_normals
from tests.animators.swingar.swingar_samples import sheet

FRAMES, CLIPS = 60, 4


def garment(size: float) -> GarmentSample:
    """A sheet of that size that hangs from the pelvis."""
    vertices, faces = sheet(size=size)
    vertices = vertices * np.float32([1, 1, -1])
    count = len(vertices)
    features = np.concatenate([vertex_normals(vertices, faces), vertices, np.full((count, 1), 0.01)], 1)
    logits = np.full((count, 24), -7.0, np.float32)
    logits[:, 0] = 0.0
    mass = np.full(count, 0.2 / count, np.float32)
    descriptor = np.linspace(3, 0.1, 16).astype(np.float32) / np.float32(size)
    return GarmentSample(Graph.of(faces, count), faces, features.astype(np.float32), descriptor, logits, mass)


@dataclass(frozen=True, eq=False)
class Swaying:
    """The samples: clip by clip, each of one of two garments; the last two clips are held out."""

    garments: tuple[GarmentSample, ...]
    way: np.ndarray  # the pelvis's way in each frame (clips, 64 + FRAMES, 3) [m]
    sway: np.ndarray  # a mean of past ways (clips, FRAMES)
    wall: float = -9.0  # the body is all that lies behind z = wall [m]

    @classmethod
    def made(cls, seed: int = 0) -> "Swaying":
        random = np.random.default_rng(seed)
        steps = np.arange(64 + FRAMES)
        phase, pace = random.uniform(0, 6, (CLIPS, 1)), random.uniform(0.15, 0.3, (CLIPS, 1))
        way = np.zeros((CLIPS, len(steps), 3), np.float32)
        way[..., 0] = 0.06 * np.sin(pace * steps + phase)
        sway = np.stack([np.convolve(each[:, 0], np.full(6, 1 / 6), "full")[: len(steps)] for each in way])
        return cls((garment(0.5), garment(0.7)), way, sway[:, 64:].astype(np.float32))

    @property
    def garment_of(self) -> np.ndarray:
        return np.repeat(np.arange(CLIPS) % 2, FRAMES)

    @property
    def before(self) -> np.ndarray:
        number, first = np.arange(CLIPS * FRAMES)[:, None], np.repeat(np.arange(CLIPS) * FRAMES, FRAMES)[:, None]
        return np.maximum(number - [1, 2], first)

    @property
    def has_past(self) -> np.ndarray:
        return np.ones(CLIPS * FRAMES, bool)

    @property
    def skinning_errors(self) -> np.ndarray:
        return np.full(len(self.garments), 0.05)

    @property
    def training(self) -> np.ndarray:
        return np.arange((CLIPS - 2) * FRAMES)

    @property
    def validation(self) -> np.ndarray:
        return np.arange((CLIPS - 2) * FRAMES, CLIPS * FRAMES)

    def frames(self, chosen: np.ndarray) -> FrameBatch:
        clip, frame = chosen // FRAMES, chosen % FRAMES
        one = self.garments[self.garment_of[chosen[0]]]
        positions, count = one.features[:, 3:6], len(chosen)
        motion = np.zeros((count, 65, 75), np.float32)
        motion[..., 72:] = np.stack([self.way[c, f : f + 65] for c, f in zip(clip, frame, strict=True)])
        depth = np.abs(positions).sum(1)
        truth = np.repeat(positions[None], count, 0)
        truth[..., 0] -= 1.5 * depth * self.sway[clip, frame][:, None]
        still = np.tile(np.eye(3, 4, dtype=np.float32), (count, 24, 1, 1))
        joints = np.tile(np.linspace(0, 1, 24, dtype=np.float32)[:, None], (count, 1, 3))
        heading = np.tile(np.eye(3, dtype=np.float32), (count, 1, 1))
        return FrameBatch(motion, still, joints, np.zeros((count, 76), np.float32), heading, truth)

    def heights(self, garment: int, vertices: Tensor, frames: FrameTensors) -> Tensor:
        return vertices[..., 2] - self.wall
