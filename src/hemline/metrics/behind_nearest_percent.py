"""The collision test of the papers, for comparison with their tables."""

import numpy as np

from hemline.arrays import BodyFaces, BodyVertices, Vertices
from hemline.meshes import vertex_normals


def behind_nearest_percent(vertices: Vertices, body_vertices: BodyVertices, body_faces: BodyFaces) -> float:
    r"""Returns the percentage of vertices behind the tangent plane of the body vertex nearest to them, in one frame.

    Vertex $x$ with nearest body vertex $b$ of normal $n$ counts if $(x - b) \cdot n < 0$. This is neither necessary
    nor sufficient for being inside (a winding number of the posed mesh above 0.5, see `inside_percent`), but it is what
    the papers report.

    Args:
        vertices: The garment [m].
        body_vertices: The body [m].
        body_faces: Triangles of the body.

    Returns:
        The percentage of the vertices; `mean_and_worst` summarises a clip.

    Source: Li, Shi, Zhu, Kanai, "SwinGar", 2023, the signed distance h(X) to the nearest body vertex of Eq. 14.
    """
    from scipy.spatial import KDTree

    nearest = KDTree(body_vertices).query(vertices)[1]
    normals = vertex_normals(body_vertices, body_faces)[nearest]
    return float(100 * np.mean(np.sum((vertices - body_vertices[nearest]) * normals, axis=1) < 0))
