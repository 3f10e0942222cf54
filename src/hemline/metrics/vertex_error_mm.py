"""Distances of vertices from the ground truth."""

import numpy as np

from hemline.arrays import Float, Vertices


def vertex_errors_mm(vertices: Vertices, truth: Vertices) -> Float[np.ndarray, " verts"]:
    """Returns the distance of each vertex of one frame to the same vertex in the ground truth.

    Args:
        vertices: The garment by the animator [m].
        truth: The garment in the simulation [m].

    Returns:
        Distances, float32 [mm].
    """
    return (np.linalg.norm(vertices - truth, axis=1) * 1e3).astype(np.float32)


def vertex_error_mm(errors_mm: Float[np.ndarray, "*frames verts"]) -> dict[str, float]:
    """Returns mean, 95th percentile and maximum of distances, over all frames and vertices.

    Args:
        errors_mm: Distances from `vertex_errors_mm`, of one frame or of many.

    Returns:
        `mean`, `p95`, `max` [mm].

    Example:
        >>> vertex_error_mm(vertex_errors_mm(np.zeros((2, 3)), np.array([[0, 0, 0.004], [0, 0, 0]])))["mean"]
        2.0
    """
    p95 = np.percentile(errors_mm, 95)
    return {"mean": float(errors_mm.mean(dtype=np.float64)), "p95": float(p95), "max": float(errors_mm.max())}
