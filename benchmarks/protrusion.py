"""Measures vertices of the body that protrude from the cloth, by rays inwards from them (libigl)."""

import igl
import numpy as np
from jaxtyping import Float
from scipy.spatial import cKDTree

from hemline.arrays import Faces, Normals, Vertices

MAX_DEPTH = 0.012
"""Length of the rays [m], between the thickness of a finger tip and that of a forearm."""


def protrusion(
    cloth: Vertices, cloth_faces: Faces, body: Vertices, normals: Normals
) -> Float[np.ndarray, " body_verts"]:
    """Returns the distance by which each vertex of the body protrudes from the cloth [m], 0 if it does not.

    Where the body intersects itself, a ray from one part may meet the cloth on the other, which counts as well.

    Args:
        cloth: Vertices of the cloth [m].
        cloth_faces: Triangles of the cloth.
        body: Vertices of the body [m].
        normals: Unit normals of the body.
    """
    points, triangles = cloth.astype(np.float64), cloth_faces.astype(np.int64)
    edge = np.linalg.norm(points[triangles] - np.roll(points[triangles], 1, axis=1), axis=2).max(axis=1)
    # only triangles with a near centre can meet a ray
    near = cKDTree(points[triangles].mean(axis=1)).query_ball_point(body, MAX_DEPTH + np.quantile(edge, 0.999))
    out = np.zeros(len(body))
    for vertex, candidates in enumerate(near):
        if candidates:
            hits = igl.ray_mesh_intersect(
                body[vertex].astype(np.float64), -normals[vertex].astype(np.float64), points, triangles[candidates]
            )
            out[vertex] = max((hit[1] for hit in hits if hit[1] < MAX_DEPTH), default=0.0)
    return out
