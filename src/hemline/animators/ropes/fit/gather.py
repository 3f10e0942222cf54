"""Gathering of the frames of a fit from a dataset."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from hemline.animators.base import Progress
from hemline.animators.ropes.bones.body_inputs import BODY_INPUT_COUNT, BodyAtRest, body_inputs
from hemline.animators.ropes.bones.bones import rest_bones
from hemline.animators.ropes.bones.chains import Ropes
from hemline.arrays import Float, FramesOfVertices, Int, Vertices
from hemline.bodies.body import ShapedBody
from hemline.datasets import Dataset, Row, Take
from hemline.errors import BadDataset
from hemline.files import content_hash, create_mapped_array
from hemline.learning.collision import Clearances, clearances
from hemline.learning.key_frame import to_key_frame
from hemline.learning.mirror import mirror_motion, mirror_of, mirror_transforms, mirror_vertices
from hemline.motions import Motion

from .frames import KeyFrames

SIDES = ("train", "val", "test")


@dataclass(frozen=True)
class TakeFrames:
    """The takes of a dataset that a fit uses, and the bodies they were simulated on."""

    dataset: Dataset
    rows: tuple[Row, ...]
    sides: tuple[int, ...]
    """Side of each row: 0 train, 1 val, 2 test."""

    @classmethod
    def of(cls, dataset: Dataset) -> "TakeFrames":
        """Selects all clips that did not fail, split by clip.

        Raises:
            BadDataset: There is no clip to train on.
        """
        pairs = [(row, side) for side, name in enumerate(SIDES) for row in dataset.split(name) if row.clip_frames]
        if not any(side == 0 for _, side in pairs):
            what = f"{dataset.folder} holds no take to train on"
            raise BadDataset(what, f"{len(pairs)} takes", "simulate more clips with 'hemline simulate'")
        return cls(dataset, tuple(row for row, _ in pairs), tuple(side for _, side in pairs))

    @property
    def frame_counts(self) -> list[int]:
        """Frames of each take, without the lead-in."""
        return [row.clip_frames for row in self.rows]

    def count_frames(self, *, mirrored: bool) -> int:
        """Returns the number of all frames; frames to train on count twice if they are mirrored, too."""
        again = sum(n for n, side in zip(self.frame_counts, self.sides, strict=True) if side == 0)
        return sum(self.frame_counts) + (again if mirrored else 0)

    @cached_property
    def shapes(self) -> list[tuple[float, ...]]:
        """The body shapes, in the order of first use."""
        return list(dict.fromkeys(row.betas for row in self.rows))

    @cached_property
    def shaped(self) -> list[ShapedBody]:
        """The body in each of the shapes."""
        return [self.dataset.body.shaped(betas) for betas in self.shapes]

    @cached_property
    def rests(self) -> list[Vertices]:
        """The settled drape on each of the shapes."""
        return [self.dataset.rest(betas).vertices[0] for betas in self.shapes]

    def shape_of(self, row: Row) -> int:
        return self.shapes.index(row.betas)

    def takes(self) -> Iterator[tuple[Take, int, int]]:
        """Yields each take with its side and the index of its shape."""
        for row, side in zip(self.rows, self.sides, strict=True):
            yield self.dataset.take(row), side, self.shape_of(row)

    @property
    def mark(self) -> str:
        """Hash of everything that the frames depend on."""
        checksums = ",".join(f"{row.sha256}:{side}" for row, side in zip(self.rows, self.sides, strict=True))
        return content_hash(self.dataset.garment.hash, checksums)


@dataclass(frozen=True)
class _TrainingTake:
    """The frames of one take for the networks, as simulated or mirrored."""

    vertices: FramesOfVertices
    clearances: Clearances | None
    """Clearances in the world; None if none are wanted."""
    transforms: Float[np.ndarray, "frames joints 3 4"]
    rope_bones: Float[np.ndarray, "frames nodes 3"]
    """Bones of simulated ropes in the world [m]."""
    body: Float[np.ndarray, "frames body"]
    """Motion of the body, see `body_inputs.body_inputs`."""
    side: int
    shape: int


def gather(
    source: TakeFrames,
    ropes: Ropes,
    folder: Path,
    *,
    mirror: bool,
    clear: bool = True,
    progress: Progress | None = None,
) -> tuple[KeyFrames, Clearances | None]:
    """Gathers all frames in the frame of the key joint.

    Args:
        source: The takes.
        ropes: The bones.
        folder: Displacements and clearances are mapped from files here: they may be larger than the memory.
        mirror: Add mirror images of the frames to train on, where garment and body are symmetric.
        clear: Whether clearances are wanted, which take most of the time.
        progress: Called with "frames", frames done and in all.

    Returns:
        The frames, and the clearances from the body for the collision term, or None.

    Raises:
        BadOutput: The disk of that folder has too little room.
    """
    partner = mirror_of(source.dataset.garment, source.shaped[0]) if mirror else None
    count, vertices = source.count_frames(mirrored=partner is not None), len(source.dataset.garment.vertices)
    displacements = create_mapped_array(folder / "displacements.npy", np.float32, (count, 3 * vertices))
    found = None
    if clear:
        normals = create_mapped_array(folder / "normals.npy", np.float16, (count, vertices, 3))
        found = Clearances(normals, create_mapped_array(folder / "heights.npy", np.float16, (count, vertices)))
    bones, rope_bones = (np.empty((count, ropes.node_count, 3), np.float32) for _ in range(2))
    body = np.empty((count, BODY_INPUT_COUNT), np.float32)
    sides, takes = np.empty(count, np.int32), np.empty(count, np.int32)
    rests = [rest_bones(ropes, rest, shaped) for rest, shaped in zip(source.rests, source.shaped, strict=True)]
    first = 0
    for number, frames_of_take in enumerate(_training_takes(source, ropes, partner, clear)):
        at, shape = slice(first, first + len(frames_of_take.vertices)), frames_of_take.shape
        keys = frames_of_take.transforms[:, ropes.key_index]
        displacements[at] = (_in_key(frames_of_take.vertices, keys) - source.rests[shape]).reshape(len(keys), -1)
        mesh_bones = ropes.positions_on(frames_of_take.vertices)
        mesh_bones[:, ropes.kinematic] = ropes.kinematic_paths(frames_of_take.transforms, source.shaped[shape])
        bones[at] = _in_key(mesh_bones, keys) - rests[shape]
        rope_bones[at] = _in_key(frames_of_take.rope_bones, keys) - rests[shape]
        body[at] = frames_of_take.body
        sides[at], takes[at] = frames_of_take.side, number
        if found is not None and frames_of_take.clearances is not None:
            found.normals[at] = np.einsum("fvi,fij->fvj", frames_of_take.clearances.normals, keys[:, :, :3])
            found.heights[at] = frames_of_take.clearances.heights
        first = at.stop
        if progress is not None:
            progress("frames", first, count)
    free = np.ones((ropes.node_count, 3), np.float32)
    free[ropes.kinematic] = 0
    frames = KeyFrames(
        displacements=displacements,
        bones=bones.reshape(count, -1),
        rope_bones=rope_bones.reshape(count, -1),
        body=body,
        free=free.reshape(-1),
        side=sides,
        take=takes,
        mark=content_hash(source.mark, bones),
    )
    return frames, found


def _training_takes(
    source: TakeFrames, ropes: Ropes, partner: np.ndarray | None, clear: bool
) -> Iterator[_TrainingTake]:
    for take, side, shape in source.takes():
        shaped, clip = source.shaped[shape], take.clip_frames
        at_rest = BodyAtRest(ropes.key_index, np.asarray(shaped.joints, np.float64))
        moving = _transforms(shaped, take)
        vertices = take.vertices[clip]
        near = _clearances(vertices, shaped, take) if clear else None
        rope_bones = _simulate_ropes(ropes, shaped, take.motion)[clip]
        body = _body_inputs(at_rest, moving, clip, take.motion.fps)
        yield _TrainingTake(vertices, near, moving[clip], rope_bones, body, side, shape)
        if partner is not None and side == 0:
            vertices, moving = mirror_vertices(vertices, partner), mirror_transforms(moving)
            if near is not None:
                near = Clearances(mirror_vertices(near.normals, partner), near.heights[:, partner])
            rope_bones = _simulate_ropes(ropes, shaped, mirror_motion(take.motion))[clip]
            body = _body_inputs(at_rest, moving, clip, take.motion.fps)
            yield _TrainingTake(vertices, near, moving[clip], rope_bones, body, side, shape)


def _body_inputs(
    at_rest: BodyAtRest, moving: Float[np.ndarray, "frames joints 3 4"], clip: Int[np.ndarray, " clip"], fps: float
) -> Float[np.ndarray, "clip body"]:
    """Returns the motion of the body in the frames of a clip, from the skin transforms of a whole take."""
    moving = moving.astype(np.float64)
    return body_inputs(at_rest, moving[np.maximum(clip - 1, 0)], moving[clip], 1 / fps)


def _clearances(vertices: FramesOfVertices, shaped: ShapedBody, take: Take) -> Clearances:
    """Returns the clearances of the frames of a clip from the body, in the world."""
    posed = [shaped.posed(take.motion[index]) for index in take.clip_frames]
    return clearances(vertices, [body.vertices for body in posed], [body.normals for body in posed])


def _transforms(shaped: ShapedBody, take: Take) -> Float[np.ndarray, "frames joints 3 4"]:
    return shaped.transforms_of(take.motion.rotations, take.motion.translations)[0]


def _in_key(points: np.ndarray, keys: np.ndarray) -> np.ndarray:
    return np.stack([to_key_frame(key.astype(np.float64), each) for key, each in zip(keys, points, strict=True)])


def _simulate_ropes(ropes: Ropes, shaped: ShapedBody, motion: Motion) -> Float[np.ndarray, "frames nodes 3"]:
    """Returns the bones of simulated ropes along a take, from rest [m]."""
    state = ropes.start(shaped.posed(motion[0]))
    positions = []
    for index in range(len(motion)):
        state = ropes.step(state, shaped.posed(motion[index]), 1 / motion.fps)
        positions.append(state.positions)
    return np.stack(positions)
