"""Reads training frames to the device of the training."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import torch

from hemline.arrays import Int
from hemline.learning.fit.device import frame_room

from .frame_tensors import FrameTensors
from .samples import TrainingSamples

HALF_PRECISION = ("motion", "features", "turns")
"""Fields that a device keeps in half precision, as files of frames do."""
READERS = 8
"""Number of threads that read frames for a device."""


class FrameReader:
    """Reads the frames of a training set as tensors on a device.

    On the processor, frames are read from their files each time. The memory of another device holds the frames of as
    many garments as it has room for; they are copied there when the reader is made.

    Args:
        samples: The training set.
        device: The device.
        room: Memory that frames may occupy [bytes]; None for that of `frame_room`.
    """

    def __init__(self, samples: TrainingSamples, device: torch.device, room: int | None = None):
        self.samples, self.device = samples, device
        self._rows = row_numbers(samples)
        self._kept: dict[int, FrameTensors] = {}
        if room is None:
            room = frame_room(device)
        if room:
            self._fill(room)

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
