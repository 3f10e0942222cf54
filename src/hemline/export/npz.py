"""Plain NumPy arrays, for scripts."""

from pathlib import Path

import numpy as np

from hemline.files import written_whole

from .clip import Clip


def write_npz(path: Path, clip: Clip) -> tuple[Path, ...]:
    """Write `vertices` (frames, verts, 3) float32 [m], `faces` int32, `fps`, `body_vertices`, `body_faces`, `notices`.

    The body's two arrays are left out where the clip has no body, `notices` (terms, one text each) where it has none.
    No array holds objects, so that `numpy.load(path, allow_pickle=False)` reads all. Equal clips give equal bytes.

    Raises:
        BadOutput: The path cannot be written.
    """
    arrays = {"vertices": np.ascontiguousarray(clip.vertices, np.float32), "faces": _whole_numbers(clip.faces)}
    if clip.body_vertices is not None and clip.body_faces is not None:
        arrays["body_vertices"] = np.ascontiguousarray(clip.body_vertices, np.float32)
        arrays["body_faces"] = _whole_numbers(clip.body_faces)
    if clip.notices:
        arrays["notices"] = np.array(clip.notices)
    with written_whole(path) as temporary, temporary.open("wb") as stream:  # savez would add .npz to a path in capitals
        np.savez(stream, **arrays, fps=np.float64(clip.fps))
    return (path,)


def _whole_numbers(faces: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(faces, np.int32)
