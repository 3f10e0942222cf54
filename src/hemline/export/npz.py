"""NPZ: plain NumPy arrays, for scripts."""

from pathlib import Path

import numpy as np

from hemline.files import atomic_write

from .clip import Clip


def write_npz(path: Path, clip: Clip) -> tuple[Path, ...]:
    """Writes `vertices` (frames, verts, 3) float32 [m], `faces` int32, `fps`, `body_vertices`, `body_faces`, `notices`.

    A clip without a body lacks the two arrays of the body, and one without licence terms lacks `notices`. No array
    contains objects, so `numpy.load(path, allow_pickle=False)` reads all. Equal clips give equal bytes.

    Raises:
        BadOutput: The path cannot be written.
    """
    arrays = {"vertices": np.ascontiguousarray(clip.vertices, np.float32), "faces": _whole_numbers(clip.faces)}
    if clip.body_vertices is not None and clip.body_faces is not None:
        arrays["body_vertices"] = np.ascontiguousarray(clip.body_vertices, np.float32)
        arrays["body_faces"] = _whole_numbers(clip.body_faces)
    if clip.notices:
        arrays["notices"] = np.array(clip.notices)
    with (
        atomic_write(path) as temporary,
        temporary.open("wb") as stream,
    ):  # savez would append .npz to a path in capitals
        np.savez(stream, **arrays, fps=np.float64(clip.fps))
    return (path,)


def _whole_numbers(faces: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(faces, np.int32)
