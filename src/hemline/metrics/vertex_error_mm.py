"""How far vertices are from the truth."""

import numpy as np

from hemline.arrays import Float


def vertex_error_mm(
    vertices: Float[np.ndarray, "*frames verts 3"], truth: Float[np.ndarray, "*frames verts 3"]
) -> dict[str, float]:
    """Distance of each vertex to the same vertex of the truth: mean, 95th percentile and largest, over all frames.

    Args:
        vertices: Of the animator [m].
        truth: Of the simulation [m].

    Returns:
        `mean`, `p95`, `max` [mm].

    Example:
        >>> vertex_error_mm(np.zeros((2, 3)), np.array([[0, 0, 0.004], [0, 0, 0]]))["mean"]
        2.0
    """
    error = 1e3 * np.linalg.norm(np.subtract(vertices, truth, dtype=np.float64), axis=-1)
    return {"mean": float(error.mean()), "p95": float(np.percentile(error, 95)), "max": float(error.max())}
