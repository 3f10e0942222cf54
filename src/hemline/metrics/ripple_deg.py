"""Ripples of a garment: the angle between neighbouring faces."""

from collections.abc import Sequence

import numpy as np

from hemline.arrays import Faces, Int, Vertices
from hemline.meshes import face_normals


def neighbouring_faces(faces: Faces) -> Int[np.ndarray, "inner 2"]:
    """Returns both faces of each inner edge of a mesh.

    Args:
        faces: Triangles; an edge with more than two faces gives several pairs.
    """
    ends = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    order = np.lexsort((ends[:, 1], ends[:, 0]))
    same = np.flatnonzero((ends[order[1:]] == ends[order[:-1]]).all(axis=1))
    return np.stack([order[same] // 3, order[same + 1] // 3], axis=1)


def ripple_deg(vertices: Vertices, faces: Faces, pairs: Int[np.ndarray, "inner 2"]) -> float:
    """Returns the mean angle between neighbouring faces of one frame.

    Args:
        vertices: The garment [m].
        faces: Triangles of the garment.
        pairs: Pairs from `neighbouring_faces`.

    Returns:
        The mean [degrees]; faces without area count as lying flat.
    """
    normals = np.asarray(face_normals(np.asarray(vertices, np.float64), faces))
    normals = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    one, other = normals[pairs[:, 0]], normals[pairs[:, 1]]
    sines, cosines = np.linalg.norm(np.cross(one, other), axis=1), (one * other).sum(axis=1)
    return float(np.degrees(np.arctan2(sines, cosines)).mean())


def ripple_figures(frames: Sequence[tuple[float, float | None]]) -> dict[str, float | None]:
    """Summarises the ripples of a clip.

    Args:
        frames: For each frame, `ripple_deg` of the garment, and that of the ground truth, or None if there is none.

    Returns:
        `mean` and `truth` [degrees]; `truth` is None without a ground truth.

    Example:
        >>> ripple_figures([(12.0, 6.0), (14.0, 8.0)])
        {'mean': 13.0, 'truth': 7.0}
    """
    truths = [truth for _, truth in frames if truth is not None]
    return {
        "mean": float(np.mean([ours for ours, _ in frames])),
        "truth": float(np.mean(truths)) if truths else None,
    }
