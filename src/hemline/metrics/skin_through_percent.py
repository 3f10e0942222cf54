"""Skin that looks out through cloth that covers it."""

import numpy as np

from hemline.arrays import BodyVertices, Bool, Faces, Float, Int, Vertices
from hemline.meshes import ClosestTree, boundary_loops

NEAR = 0.02
"""Skin is covered where cloth is in front of it no farther away than this at rest [m]; and looks out no farther."""
THROUGH = 0.0005
"""Skin that is less far in front of the cloth does not count [m]."""
FACING = 0.5
"""Least cosine between the normals of cloth and skin: in an armpit the nearest cloth may be a sleeve's."""


def covered_skin(
    vertices: Vertices, faces: Faces, body_vertices: BodyVertices, body_normals: Float[np.ndarray, "body_verts 3"]
) -> Int[np.ndarray, " covered"]:
    """Vertices of the body that a garment covers closely at rest.

    Args:
        vertices: The garment at rest [m].
        faces: Its triangles.
        body_vertices: The body at rest [m].
        body_normals: Its normals.
    """
    side, rim, normals = _in_front(vertices, faces, body_vertices)
    facing = np.einsum("px,px->p", normals, body_normals) > FACING
    return np.flatnonzero((side < 0) & (side > -NEAR) & facing & ~rim)


def skin_through_percent(
    vertices: Vertices,
    faces: Faces,
    body_vertices: BodyVertices,
    body_normals: Float[np.ndarray, "body_verts 3"],
    covered: Int[np.ndarray, " covered"],
    buried: Bool[np.ndarray, " covered"] | None = None,
) -> float:
    """Share of the covered skin that is in front of the cloth in one frame, and can be seen.

    A vertex of the body counts if the nearest place of the garment is behind it, by more than half a millimetre and
    less than two centimetres, faces the way the skin does, and is not on a rim of the garment.

    Args:
        vertices: The garment [m].
        faces: Its triangles.
        body_vertices: The body [m].
        body_normals: Its normals.
        covered: From `covered_skin`.
        buried: Whether each of these is inside another part of the body, as an arm's skin is in an armpit: nobody sees
            it, and cloth has no place between the two. It does not count. None: none is.

    Returns:
        The share [percent of the covered vertices]; 0 where nothing is covered.
    """
    if not len(covered):
        return 0.0
    side, rim, normals = _in_front(vertices, faces, body_vertices[covered])
    facing = np.einsum("px,px->p", normals, body_normals[covered]) > FACING
    through = (side > THROUGH) & (side < NEAR) & facing & ~rim
    return float(100 * np.mean(through if buried is None else through & ~buried))


def _in_front(
    vertices: Vertices, faces: Faces, points: BodyVertices
) -> tuple[Float[np.ndarray, " points"], Bool[np.ndarray, " points"], Float[np.ndarray, "points 3"]]:
    """How far points are in front of the cloth, whether their nearest place is on a rim, and the normal there."""
    tree = ClosestTree(np.asarray(vertices, np.float64), faces)
    closest = tree.closest(points)
    normals = tree.outward(closest)
    side = np.sign(np.einsum("px,px->p", points - closest.positions, normals)) * closest.distances
    on_rim = np.zeros(len(vertices), bool)
    for loop in boundary_loops(faces):
        on_rim[loop] = True
    rim = (on_rim[faces[closest.faces]] & (closest.weights > 1e-6)).sum(axis=1) >= (closest.weights > 1e-6).sum(axis=1)
    return side, rim, normals
