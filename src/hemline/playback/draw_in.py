"""Skin below a garment that an engine swings, drawn in so that the cloth has room."""

import numpy as np

from hemline.arrays import AnyFaces, AnyVertices, BodyVertices
from hemline.bodies.body import PosedBody
from hemline.meshes import ClosestTree, boundary_loops

DEPTH = 0.015
"""Largest distance by which covered skin is drawn in [m]."""
FADE = 0.08
"""Distance from the edge of the garment over which the depth grows from nothing [m]."""
REACH = 0.3
"""Largest distance from skin to the cloth that covers it [m]."""


def draw_in(posed: PosedBody, vertices: AnyVertices, faces: AnyFaces) -> BodyVertices:
    """Returns the body's vertices, with those behind a garment drawn in along their normals.

    Artists do the same, or delete covered skin: cloth on bones is only nearly where its bones are.

    Args:
        posed: The body.
        vertices: The garment on it [m].
        faces: Triangles of the garment.
    """
    skin, normals = np.asarray(posed.vertices, np.float64), np.asarray(posed.normals, np.float64)
    tree = ClosestTree(np.asarray(vertices, np.float64), faces)
    closest = tree.closest(skin)
    outward = tree.outward(closest)
    behind = np.einsum("px,px->p", skin - closest.positions, outward) < 0
    facing = np.einsum("px,px->p", normals, outward) > 0
    depth = DEPTH * np.clip(_from_edge(closest.positions, vertices, faces) / FADE, 0.0, 1.0)
    covered = behind & facing & (closest.distances < REACH)
    return (skin - np.where(covered, depth, 0.0)[:, None] * normals).astype(np.float32)


def _from_edge(points: np.ndarray, vertices: AnyVertices, faces: AnyFaces) -> np.ndarray:
    """Returns the distance of points to the edge of a garment [m]."""
    from scipy.spatial import KDTree

    loops = boundary_loops(faces)
    return KDTree(vertices[np.concatenate(loops)]).query(points)[0] if loops else np.full(len(points), np.inf)
