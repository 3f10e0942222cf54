"""The papers' test for vertices inside the body, for comparison with their tables."""

import numpy as np

from hemline.arrays import BodyFaces, FramesOfBodyVertices, FramesOfVertices
from hemline.meshes import vertex_normals


def nearest_inside_percent(
    vertices: FramesOfVertices, body_vertices: FramesOfBodyVertices, body_faces: BodyFaces
) -> dict[str, float]:
    r"""Vertices behind the tangent plane of the body vertex nearest to them.

    Vertex $x$ with nearest body vertex $b$ of normal $n$ counts if $(x - b) \cdot n < 0$. It is neither necessary nor
    sufficient for being inside (see `inside_percent` for that), but it is what the papers print.

    Args:
        vertices: The garment [m].
        body_vertices: The body [m].
        body_faces: Triangles of the body.

    Returns:
        `mean` and `worst_frame` [percent of the vertices].

    Source: Li et al., "SwinGar: Spectrum-Inspired Neural Dynamic Deformation for Free-Swinging Garments", 2023, the
        signed distance h(X) to the nearest body vertex of Eq. 14.
    """
    from scipy.spatial import KDTree

    shares = []
    for cloth, body in zip(vertices, body_vertices, strict=True):
        nearest = KDTree(body).query(cloth)[1]
        away = np.sum((cloth - body[nearest]) * vertex_normals(body, body_faces)[nearest], axis=1)
        shares.append(100 * np.mean(away < 0))
    return {"mean": float(np.mean(shares)), "worst_frame": float(np.max(shares))}
