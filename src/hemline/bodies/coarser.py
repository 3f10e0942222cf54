"""A body of fewer vertices that holds most of the full one: what cloth that is far from the camera is kept out of."""

import functools
from dataclasses import replace

import numpy as np

from hemline.errors import BadInput
from hemline.meshes import ClosestTree, CoarserMesh, coarser, vertex_normals

from .body import Body, ShapedBody

EVENNESS = 1e-4
"""How much even edges count beside the shape, see `meshes.coarser`."""


@functools.lru_cache(maxsize=32)
def coarser_body(shaped: ShapedBody, share: float) -> ShapedBody:
    """The body with some of its vertices, each moved outward by as much as the skin next to it stands out.

    It moves as the full body does: joints, weights and pose-dependent offsets of what is left are the same.

    Args:
        shaped: The full body.
        share: How many of its vertices to keep, above 0 and at most 1. 1 gives the body itself.

    Raises:
        BadInput: `share` is not such a number.
        BadMesh: Too few vertices would be left.
    """
    if not 0 < share <= 1:
        raise BadInput("a share of vertices is above 0 and at most 1", share, "use 1 for all, 0.25 for a quarter")
    if share == 1:
        return shaped
    body = shaped.body
    mesh = _mesh(body, round(share * len(body.template)))
    vertices = _held_in(shaped.vertices[mesh.kept], mesh.faces, shaped.vertices)
    left = replace(
        body,
        template=vertices,
        faces=mesh.faces,
        shapedirs=body.shapedirs[:, mesh.kept],
        weight_indices=body.weight_indices[mesh.kept],
        weights=body.weights[mesh.kept],
        posedirs=None if body.posedirs is None else body.posedirs[:, mesh.kept],
    )
    normals = vertex_normals(vertices, mesh.faces).astype(np.float32)
    return replace(shaped, body=left, vertices=vertices, normals=normals)


@functools.lru_cache(maxsize=32)
def _mesh(body: Body, count: int) -> CoarserMesh:
    """Found once for all shapes of a body."""
    return coarser(body.template, body.faces, count, evenness=EVENNESS)


def _held_in(vertices: np.ndarray, faces: np.ndarray, skin: np.ndarray) -> np.ndarray:
    """Vertices moved along their normals by as much as the skin over their triangles stands out."""
    vertices, skin = np.asarray(vertices, np.float64), np.asarray(skin, np.float64)
    tree = ClosestTree(vertices, faces)
    closest = tree.closest(skin)
    heights = ((skin - closest.positions) * tree.outward(closest)).sum(axis=1)
    lift = np.zeros(len(vertices))
    np.maximum.at(lift, faces[closest.faces].reshape(-1), np.repeat(np.maximum(heights, 0), 3))
    return (vertices + lift[:, None] * vertex_normals(vertices, faces)).astype(np.float32)
