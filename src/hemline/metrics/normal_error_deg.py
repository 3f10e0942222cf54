"""How far the triangles' normals are from the truth's: wrinkles that are missing or elsewhere."""

import numpy as np

from hemline.arrays import Faces, Float, Vertices


def normal_errors_deg(vertices: Vertices, truth: Vertices, faces: Faces) -> Float[np.ndarray, " faces"]:
    """Angle between the normals of each triangle of one frame here and in the truth.

    Args:
        vertices: Of the animator [m].
        truth: Of the simulation [m].
        faces: Triangles of both.

    Returns:
        Angles [degrees]; nan for triangles without area, here or there.
    """
    ours, theirs = _across(vertices, faces), _across(truth, faces)
    sine, cosine = np.linalg.norm(np.cross(ours, theirs), axis=1), np.sum(ours * theirs, axis=1)
    kept = (np.linalg.norm(ours, axis=1) > 0) & (np.linalg.norm(theirs, axis=1) > 0)
    return np.where(kept, np.degrees(np.arctan2(sine, cosine)), np.nan)


def normal_error_deg(errors_deg: Float[np.ndarray, "*frames faces"]) -> dict[str, float]:
    """Mean and 95th percentile of angles, over all frames and triangles that have an area.

    Args:
        errors_deg: Of `normal_errors_deg`, of one frame or of many.

    Returns:
        `mean`, `p95` [degrees]; nan where every triangle is without area.
    """
    kept = errors_deg[~np.isnan(errors_deg)]
    if not len(kept):
        return {"mean": float("nan"), "p95": float("nan")}
    return {"mean": float(kept.mean()), "p95": float(np.percentile(kept, 95))}


def _across(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    corners = np.asarray(vertices, np.float64)[faces]
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
