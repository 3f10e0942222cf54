"""Vertices of the body that stand out of the cloth: rays inwards from them meet it. Counted by libigl."""

import igl
import numpy as np
from jaxtyping import Float
from scipy.spatial import cKDTree

from hemline.arrays import Faces, Normals, Vertices

DEEPEST = 0.012
"""How far inwards is looked [m]: less than the thickness of a forearm, more than that of a finger's tip."""


def standing_out(
    cloth: Vertices, cloth_faces: Faces, body: Vertices, normals: Normals
) -> Float[np.ndarray, " body_verts"]:
    """How far each vertex of the body stands out of the cloth [m], 0 where it does not.

    Where the body cuts through itself, a ray from one part meets the cloth on the other, which counts too.

    Args:
        cloth: Vertices of the cloth [m].
        cloth_faces: Its triangles.
        body: Vertices of the body [m].
        normals: Their unit normals.
    """
    points, triangles = cloth.astype(np.float64), cloth_faces.astype(np.int64)
    edge = np.linalg.norm(points[triangles] - np.roll(points[triangles], 1, axis=1), axis=2).max(axis=1)
    # a ray meets a triangle only if the middle of that is near
    near = cKDTree(points[triangles].mean(axis=1)).query_ball_point(body, DEEPEST + np.quantile(edge, 0.999))
    out = np.zeros(len(body))
    for vertex, found in enumerate(near):
        if found:
            hits = igl.ray_mesh_intersect(
                body[vertex].astype(np.float64), -normals[vertex].astype(np.float64), points, triangles[found]
            )
            out[vertex] = max((hit[1] for hit in hits if hit[1] < DEEPEST), default=0.0)
    return out
