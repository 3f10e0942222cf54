"""How far the triangles' normals are from the truth's: wrinkles that are missing or elsewhere."""

import numpy as np

from hemline.arrays import Faces, Float


def normal_error_deg(
    vertices: Float[np.ndarray, "*frames verts 3"], truth: Float[np.ndarray, "*frames verts 3"], faces: Faces
) -> dict[str, float]:
    """Angle between the normals of each triangle here and in the truth, over all frames.

    Triangles without area, here or there, are left out.

    Args:
        vertices: Of the animator [m].
        truth: Of the simulation [m].
        faces: Triangles of both.

    Returns:
        `mean`, `p95` [degrees]; nan where every triangle is without area.
    """
    ours, theirs = _across(vertices, faces), _across(truth, faces)
    sine = np.linalg.norm(np.cross(ours, theirs), axis=-1)
    cosine = np.sum(ours * theirs, axis=-1)
    kept = (np.linalg.norm(ours, axis=-1) > 0) & (np.linalg.norm(theirs, axis=-1) > 0)
    if not kept.any():
        return {"mean": float("nan"), "p95": float("nan")}
    angle = np.degrees(np.arctan2(sine, cosine))[kept]
    return {"mean": float(angle.mean()), "p95": float(np.percentile(angle, 95))}


def _across(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    corners = np.asarray(vertices, np.float64)[..., faces, :]
    return np.cross(corners[..., 1, :] - corners[..., 0, :], corners[..., 2, :] - corners[..., 0, :])
