"""MDD, the point cache of LightWave, which most animation programs read."""

import struct
from pathlib import Path

import numpy as np

from .clip import Clip, ClipPart
from .point_cache import write_caches


def write_mdd(path: Path, clip: Clip) -> tuple[Path, ...]:
    """Writes point caches (big-endian) and OBJ files of the first frame.

    Layout: number of frames, number of points, the time of each frame [s], then the positions [m], y up, one frame
    after another.

    Raises:
        BadOutput: The path cannot be written.
    """
    return write_caches(path, clip, mdd_bytes)


def mdd_bytes(part: ClipPart, fps: float) -> bytes:
    """Returns the bytes of one cache."""
    frames, points = part.vertices.shape[:2]
    times = (np.arange(frames) / fps).astype(">f4").tobytes()
    return struct.pack(">ii", frames, points) + times + np.ascontiguousarray(part.vertices, ">f4").tobytes()
