"""PC2, the point cache of 3ds Max, which Blender's Mesh Cache modifier and Houdini read."""

import struct
from pathlib import Path

import numpy as np

from .clip import Clip, ClipPart
from .point_cache import write_caches


def write_pc2(path: Path, clip: Clip) -> tuple[Path, ...]:
    """Writes point caches of format 1 (little-endian float32) and OBJ files of the first frame.

    Layout: `POINTCACHE2\\0`, version 1, points, first frame 0, one sample per frame, number of samples;
    then the positions [m], y up, one sample after another. The format stores no frame rate: set that of the scene. In
    Blender the Mesh Cache modifier of the imported OBJ keeps its default axes.

    Raises:
        BadOutput: The path cannot be written.
    """
    return write_caches(path, clip, pc2_bytes)


def pc2_bytes(part: ClipPart, fps: float) -> bytes:
    """Returns the bytes of one cache; the format does not store `fps`."""
    frames, points = part.vertices.shape[:2]
    header = struct.pack("<12siiffi", b"POINTCACHE2\0", 1, points, 0.0, 1.0, frames)
    return header + np.ascontiguousarray(part.vertices, "<f4").tobytes()
