"""Training frames as tensors on the device of the training."""

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields, replace
from functools import cache
from typing import Any

import numpy as np
import torch
from torch import Tensor

from hemline.animators.coarse.features.columns import VECTOR
from hemline.animators.swingar.graph_inputs import VERTEX
from hemline.arrays import Int
from hemline.learning.mirror import opposite_joints
from hemline.motions.motion import JOINT_COUNT

from .samples import FrameBatch, TrainingSamples

AXIS_ANGLE_SIGNS = (1.0, -1.0, -1.0)
"""Signs of a mirrored axis-angle."""
TURN_SIGNS = (1.0, 1.0, -1.0, -1.0)
"""Signs of a mirrored quaternion, wxyz."""
HALF_PRECISION = ("motion", "features", "turns")
"""Fields that a device keeps in half precision, as files of frames do."""
READERS = 8
"""Number of threads that read frames for a device."""
ROOM = 0.7
"""Fraction of the free memory of a device that frames may occupy."""


@dataclass(frozen=True, eq=False)
class FrameTensors:
    """The fields of `FrameBatch` as tensors on one device."""

    motion: Tensor
    """The last 65 poses (frames, poses, 75)."""
    transforms: Tensor
    """Skinning transforms of the joints (frames, joints, 3, 4) [m]."""
    joints: Tensor
    """Positions of the joints (frames, joints, 3) [m]."""
    body: Tensor
    """Betas and axis-angles of the present pose (frames, body)."""
    heading: Tensor
    """Rotations from the frame's own heading to one that all frames of a clip share (frames, 3, 3)."""
    truth: Tensor
    """Vertices of the ground truth (frames, verts, 3) [m]."""
    features: Tensor | None
    """Features of the vertices (frames, verts, features)."""
    turns: Tensor | None
    """Rotation of each vertex by skinning, wxyz (frames, verts, 4)."""

    @classmethod
    def of(cls, batch: FrameBatch, device: torch.device, *, halves: Iterable[str] = ()) -> "FrameTensors":
        """Copies frames to a device.

        Args:
            batch: The frames.
            device: The device.
            halves: Names of the fields that become float16.
        """
        arrays = {each.name: getattr(batch, each.name) for each in fields(cls)}
        found: dict[str, Any] = {
            name: None if each is None else torch.from_numpy(each) for name, each in arrays.items()
        }
        halved = {name: each.half() for name, each in found.items() if each is not None and name in set(halves)}
        return cls(**(found | halved)).to(device)

    def to(self, device: torch.device) -> "FrameTensors":
        """Copies the tensors to a device."""
        return self._changed(lambda each: each.to(device))

    @property
    def byte_count(self) -> int:
        """Memory that the tensors occupy [bytes]."""
        return sum(each.nbytes for each in vars(self).values() if each is not None)

    def select(self, rows: Tensor) -> "FrameTensors":
        """Returns some of the frames, float32."""
        return self._changed(lambda each: each[rows].float())

    def _changed(self, change: Callable[[Tensor], Tensor]) -> "FrameTensors":
        """Returns the frames with a function applied to each tensor."""
        changed: dict[str, Any] = {name: None if each is None else change(each) for name, each in vars(self).items()}
        return FrameTensors(**changed)

    def mirror(self) -> "FrameTensors":
        """Returns the mirror image of the frames. Betas do not change, since bodies are symmetric."""
        device, others = self.truth.device, opposite_joints()
        vector, axes, turn = (
            _constant(each, device) for each in (tuple(VECTOR.tolist()), AXIS_ANGLE_SIGNS, TURN_SIGNS)
        )

        def mirror_axes(values: Tensor) -> Tensor:
            return (values.unflatten(-1, (JOINT_COUNT, 3))[..., others, :] * axes).flatten(-2)

        split = 3 * JOINT_COUNT
        motion = torch.cat([mirror_axes(self.motion[..., :split]), self.motion[..., split:] * vector], dim=-1)
        body = torch.cat([self.body[:, :-split], mirror_axes(self.body[:, -split:])], dim=-1)
        order, signs = VERTEX.mirror()
        features = self.features
        if features is not None:
            features = features[..., torch.from_numpy(order).to(device)] * torch.from_numpy(signs).to(device)
        return FrameTensors(
            motion,
            self.transforms[:, others] * vector[:, None] * torch.cat([vector, vector.new_ones(1)]),
            self.joints[:, others] * vector,
            body,
            self.heading * vector * vector[:, None],
            self.truth * vector,
            features,
            None if self.turns is None else self.turns * turn,
        )

    def forget_beginning(self) -> "FrameTensors":
        """Returns the frames with the features cleared that say how the garment lay at the beginning."""
        if self.features is None:
            return self
        kept = torch.ones(VERTEX.count, device=self.truth.device)
        kept[VERTEX["beginning"]] = 0
        return replace(self, features=self.features * kept)


@cache
def _constant(values: tuple[float, ...], device: torch.device) -> Tensor:
    return torch.tensor(values, device=device)


class FrameReader:
    """Reads the frames of a training set as tensors on a device.

    On the processor, frames are read from their files each time. The memory of another device holds the frames of as
    many garments as it has room for; they are copied there when the reader is made.

    Args:
        samples: The training set.
        device: The device.
    """

    def __init__(self, samples: TrainingSamples, device: torch.device):
        self.samples, self.device = samples, device
        self._rows = row_numbers(samples)
        self._kept: dict[int, FrameTensors] = {}
        if device.type == "cuda":
            self._fill(int(ROOM * torch.cuda.mem_get_info(device)[0]))

    def read(self, chosen: Int[np.ndarray, " frames"]) -> FrameTensors:
        """Returns some samples, all of one garment, float32."""
        kept = self._kept.get(int(self.samples.garment_of[chosen[0]]))
        if kept is not None:
            return kept.select(torch.from_numpy(self._rows[chosen]).to(self.device))
        return FrameTensors.of(self.samples.frames(chosen), self.device)

    def _fill(self, room: int) -> None:
        """Copies garments to the device until they occupy a given memory [bytes]."""

        def frames_of(garment: int) -> FrameTensors:
            whole = self.samples.frames(np.flatnonzero(self.samples.garment_of == garment))
            return FrameTensors.of(whole, torch.device("cpu"), halves=HALF_PRECISION)

        garments = range(len(self.samples.garments))
        with ThreadPoolExecutor(READERS) as readers:
            for first in range(0, len(garments), READERS):
                some = garments[first : first + READERS]
                for garment, frames in zip(some, readers.map(frames_of, some), strict=True):
                    room -= frames.byte_count
                    if room < 0:
                        return
                    self._kept[garment] = frames.to(self.device)


def row_numbers(samples: TrainingSamples) -> Int[np.ndarray, " samples"]:
    """Returns the number of each sample among those of its garment."""
    of = np.asarray(samples.garment_of)
    order = np.argsort(of, kind="stable")
    firsts = np.searchsorted(of[order], of[order])
    rows = np.empty(len(of), np.int64)
    rows[order] = np.arange(len(of)) - firsts
    return rows
