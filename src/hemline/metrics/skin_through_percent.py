"""Percentage of covered skin that shows through the cloth."""

import numpy as np

from hemline.arrays import BodyVertices, Bool, Faces, Float, Int, Vertices
from hemline.meshes import ClosestTree, boundary_loops

COVER_DISTANCE = 0.02
"""Largest distance at rest from covered skin to the cloth in front of it, and of showing skin in front of cloth [m]."""
LEAST_SHOWING = 0.0005
"""Least distance of showing skin in front of the cloth [m]."""
LEAST_COSINE = 0.5
"""Least cosine between the normals of cloth and skin: in an armpit the nearest cloth may be a sleeve's."""


def skin_under_cloth(
    vertices: Vertices, faces: Faces, body_vertices: BodyVertices, body_normals: Float[np.ndarray, "body_verts 3"]
) -> Int[np.ndarray, " covered"]:
    """Returns the vertices of the body that a garment covers closely at rest.

    Args:
        vertices: The garment at rest [m].
        faces: Triangles of the garment.
        body_vertices: The body at rest [m].
        body_normals: Normals of the body.
    """
    side, rim, normals = _in_front(vertices, faces, body_vertices)
    facing = np.einsum("px,px->p", normals, body_normals) > LEAST_COSINE
    return np.flatnonzero((side < 0) & (side > -COVER_DISTANCE) & facing & ~rim)


def skin_through_percent(
    vertices: Vertices,
    faces: Faces,
    body_vertices: BodyVertices,
    body_normals: Float[np.ndarray, "body_verts 3"],
    covered: Int[np.ndarray, " covered"],
    buried: Bool[np.ndarray, " covered"] | None = None,
) -> float:
    """Returns the percentage of covered skin that is visible in front of the cloth in one frame.

    A vertex of the body counts if the nearest place of the garment is behind it, by more than half a millimetre and
    less than two centimetres, faces the same way as the skin, and is not on a rim of the garment.

    Args:
        vertices: The garment [m].
        faces: Triangles of the garment.
        body_vertices: The body [m].
        body_normals: Normals of the body.
        covered: Vertices from `skin_under_cloth`.
        buried: Whether each of these is inside another part of the body, as an arm's skin is in an armpit; such a
            vertex is invisible and does not count. None: none is.

    Returns:
        The percentage of the covered vertices; 0 if nothing is covered.
    """
    if not len(covered):
        return 0.0
    side, rim, normals = _in_front(vertices, faces, body_vertices[covered])
    facing = np.einsum("px,px->p", normals, body_normals[covered]) > LEAST_COSINE
    through = (side > LEAST_SHOWING) & (side < COVER_DISTANCE) & facing & ~rim
    return float(100 * np.mean(through if buried is None else through & ~buried))


def _in_front(
    vertices: Vertices, faces: Faces, points: BodyVertices
) -> tuple[Float[np.ndarray, " points"], Bool[np.ndarray, " points"], Float[np.ndarray, "points 3"]]:
    """Returns distances of points in front of the cloth [m], whether each is over a rim, and normals there."""
    tree = ClosestTree(np.asarray(vertices, np.float64), faces)
    closest = tree.closest(points)
    normals = tree.outward(closest)
    side = np.sign(np.einsum("px,px->p", points - closest.positions, normals)) * closest.distances
    on_rim = np.zeros(len(vertices), bool)
    for loop in boundary_loops(faces):
        on_rim[loop] = True
    rim = (on_rim[faces[closest.faces]] & (closest.weights > 1e-6)).sum(axis=1) >= (closest.weights > 1e-6).sum(axis=1)
    return side, rim, normals
