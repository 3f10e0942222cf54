"""Angles between triangle normals and those of the ground truth, which reveal missing or misplaced wrinkles."""

import numpy as np

from hemline.arrays import Faces, Float, Vertices


def normal_errors_deg(vertices: Vertices, truth: Vertices, faces: Faces) -> Float[np.ndarray, " faces"]:
    """Returns the angle between the normals of each triangle in one frame and in the ground truth.

    Args:
        vertices: The garment by the animator [m].
        truth: The garment in the simulation [m].
        faces: Triangles of both.

    Returns:
        Angles [degrees]; NaN for triangles without area in either.
    """
    ours, theirs = _across(vertices, faces), _across(truth, faces)
    sine, cosine = np.linalg.norm(np.cross(ours, theirs), axis=1), np.sum(ours * theirs, axis=1)
    valid = (np.linalg.norm(ours, axis=1) > 0) & (np.linalg.norm(theirs, axis=1) > 0)
    return np.where(valid, np.degrees(np.arctan2(sine, cosine)), np.nan)


def normal_error_deg(errors_deg: Float[np.ndarray, "*frames faces"]) -> dict[str, float]:
    """Returns mean and 95th percentile of angles, over all frames and triangles with an area.

    Args:
        errors_deg: Angles from `normal_errors_deg`, of one frame or of many.

    Returns:
        `mean`, `p95` [degrees]; NaN if no triangle has an area.
    """
    valid = errors_deg[~np.isnan(errors_deg)]
    if not len(valid):
        return {"mean": float("nan"), "p95": float("nan")}
    return {"mean": float(valid.mean()), "p95": float(np.percentile(valid, 95))}


def _across(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    corners = np.asarray(vertices, np.float64)[faces]
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
