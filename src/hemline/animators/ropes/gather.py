"""From a dataset to the frames that a fit learns from."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from hemline import bodies
from hemline.arrays import FramesOfVertices, Points, Transforms, Vertices
from hemline.bodies.shaped import ShapedBody
from hemline.collide.proxy import BodyProxy
from hemline.datasets import Dataset, Row, Take
from hemline.errors import BadDataset
from hemline.files import content_hash

from .bones import rest_bones
from .chains import Ropes
from .frames import Frames
from .keyframe import from_key, to_key

SIDES = ("train", "val", "test")


@dataclass(frozen=True)
class BodyDistances:
    """Distances to the body's primitives in every frame, in the frame of the key joint."""

    proxies: tuple[BodyProxy, ...]
    """One a body shape."""
    shape: np.ndarray
    """Which of them a frame belongs to."""
    transforms: np.ndarray
    """Skin transforms of each frame."""
    key: int
    """Index of the key joint."""

    def __call__(self, frame: int, points: Points) -> np.ndarray:
        """Signed distances of points in a frame's key frame [m]."""
        transforms = self.transforms[frame]
        world = from_key(transforms[self.key], points)
        return self.proxies[self.shape[frame]].distances(world, transforms)[0]


@dataclass(frozen=True)
class Source:
    """The takes of a dataset that a fit uses, and the bodies they were simulated on."""

    dataset: Dataset
    rows: tuple[Row, ...]
    sides: tuple[int, ...]
    """0 train, 1 val, 2 test, of each row."""

    @classmethod
    def of(cls, dataset: Dataset) -> "Source":
        """All clips that did not fail, split by clip.

        Raises:
            BadDataset: There is none to train on.
        """
        pairs = [(row, side) for side, name in enumerate(SIDES) for row in dataset.split(name) if row.clip_frames]
        if not any(side == 0 for _, side in pairs):
            what = f"{dataset.folder} holds no take to train on"
            raise BadDataset(what, f"{len(pairs)} takes", "simulate more clips with 'hemline simulate'")
        return cls(dataset, tuple(row for row, _ in pairs), tuple(side for _, side in pairs))

    @property
    def frame_count(self) -> int:
        """Frames of all takes, lead-ins left out."""
        return sum(row.clip_frames for row in self.rows)

    @cached_property
    def shapes(self) -> list[tuple[float, ...]]:
        """The body shapes, in the order of first use."""
        return list(dict.fromkeys(row.betas for row in self.rows))

    @cached_property
    def shaped(self) -> list[ShapedBody]:
        """The body in each of them."""
        body = bodies.load(self.dataset.garment.body_name)
        return [body.shaped(betas) for betas in self.shapes]

    @cached_property
    def rests(self) -> list[Vertices]:
        """The settled drape on each of them."""
        return [self.dataset.rest(betas).vertices[0] for betas in self.shapes]

    def shape_of(self, row: Row) -> int:
        return self.shapes.index(row.betas)

    def takes(self) -> Iterator[tuple[Take, int, int]]:
        """Each take with its side and shape."""
        for row, side in zip(self.rows, self.sides, strict=True):
            yield self.dataset.take(row), side, self.shape_of(row)

    @property
    def mark(self) -> str:
        """Hash of all that the frames depend on."""
        checksums = ",".join(f"{row.sha256}:{side}" for row, side in zip(self.rows, self.sides, strict=True))
        return content_hash(self.dataset.garment.hash, checksums)


def gather(source: Source, ropes: Ropes, folder: Path, *, roped: bool) -> tuple[Frames, BodyDistances]:
    """All frames in the frame of the key joint.

    Args:
        source: The takes.
        ropes: The bones.
        folder: Displacements are mapped from a file here, `displacements.npy`: they may be larger than the memory.
        roped: Run the ropes along every clip, too.

    Returns:
        The frames, and distances to the body for the collision term.
    """
    count, vertices = source.frame_count, len(source.dataset.garment.vertices)
    path = folder / "displacements.npy"
    displacements = np.lib.format.open_memmap(path, mode="w+", dtype=np.float32, shape=(count, 3 * vertices))
    bones, rope_bones = (np.empty((count, ropes.node_count, 3), np.float32) for _ in range(2))
    sides, shapes = np.empty(count, np.int32), np.empty(count, np.int32)
    every = np.empty((count, *source.shaped[0].posed(source.shaped[0].rest_pose).transforms.shape), np.float32)
    rests = [
        rest_bones(ropes, rest, shaped) for rest, shaped in zip(source.rests, source.shaped, strict=True)
    ]  # fmt: skip
    first = 0
    for take, side, shape in source.takes():
        at = slice(first, first + len(take.clip_frames))
        shaped, transforms = source.shaped[shape], _transforms(source.shaped[shape], take)
        keys = transforms[take.clip_frames, ropes.key_index]
        displacements[at] = _moved(take.vertices[take.clip_frames], source.rests[shape], keys)
        seen = ropes.embedded(take.vertices[take.clip_frames])
        seen[:, ropes.kinematic] = ropes.carried_by(transforms[take.clip_frames], shaped)
        bones[at] = _in_key(seen, keys) - rests[shape]
        if roped:
            rope_bones[at] = _in_key(_simulated(ropes, shaped, take, seen), keys) - rests[shape]
        every[at], sides[at], shapes[at] = transforms[take.clip_frames], side, shape
        first = at.stop
    displacements.flush()
    free = np.ones((ropes.node_count, 3), np.float32)
    free[ropes.kinematic] = 0
    frames = Frames(
        displacements=displacements, bones=bones.reshape(count, -1),
        rope_bones=rope_bones.reshape(count, -1) if roped else None, free=free.reshape(-1),
        rests=np.stack(source.rests).reshape(len(source.rests), -1), shape=shapes, side=sides, mark=source.mark,
    )  # fmt: skip
    proxies = tuple(BodyProxy.fit(shaped) for shaped in source.shaped)
    return frames, BodyDistances(proxies, shapes, every, ropes.key_index)


def _transforms(shaped: ShapedBody, take: Take) -> Transforms:
    return shaped.transforms_of(take.motion.rotations, take.motion.translations)[0]


def _moved(vertices: FramesOfVertices, rest: Vertices, keys: np.ndarray) -> np.ndarray:
    return (_in_key(vertices, keys) - rest).reshape(len(vertices), -1)


def _in_key(points: np.ndarray, keys: np.ndarray) -> np.ndarray:
    return np.stack([to_key(key.astype(np.float64), each) for key, each in zip(keys, points, strict=True)])


def _simulated(ropes: Ropes, shaped: ShapedBody, take: Take, seen: np.ndarray) -> np.ndarray:
    """The ropes' own bones along a clip; those of the truth (`seen`) while they settle, in the first second."""
    state = ropes.start(shaped.posed(take.motion[0]))
    positions = []
    for index in range(len(take.motion)):
        state = ropes.step(state, shaped.posed(take.motion[index]), 1 / take.motion.fps)
        positions.append(state.positions)
    settled = (take.clip_frames >= take.motion.fps)[:, None, None]
    return np.where(settled, np.stack(positions)[take.clip_frames], seen)
