"""Reduces a body to fewer vertices that enclose most of it, for cloth that is far from the camera."""

import functools
from dataclasses import replace

import numpy as np

from hemline.errors import BadInput
from hemline.meshes import ClosestTree, CoarseMesh, coarsen, vertex_normals

from .body import Body, ShapedBody

EVENNESS = 1e-4
"""Weight of even edges relative to the shape, see `meshes.coarser`."""


@functools.lru_cache(maxsize=32)
def coarser_body(shaped: ShapedBody, fraction: float) -> ShapedBody:
    """Reduces a body to some of its vertices, each moved outward until the skin around it is enclosed.

    It moves as the full body does: joints, weights and pose-dependent offsets of the kept vertices are the same.

    Args:
        shaped: The full body.
        fraction: Fraction of its vertices to keep, above 0 and at most 1. 1 returns the body itself.

    Raises:
        BadInput: `fraction` is out of range.
        BadMesh: Too few vertices would be kept.
    """
    if not 0 < fraction <= 1:
        raise BadInput("a share of vertices is above 0 and at most 1", fraction, "use 1 for all, 0.25 for a quarter")
    if fraction == 1:
        return shaped
    body = shaped.body
    mesh = _mesh(body, round(fraction * len(body.template)))
    vertices = _enclose(shaped.vertices[mesh.kept], mesh.faces, shaped.vertices)
    coarse = replace(
        body,
        template=vertices,
        faces=mesh.faces,
        shapedirs=body.shapedirs[:, mesh.kept],
        weight_indices=body.weight_indices[mesh.kept],
        weights=body.weights[mesh.kept],
        posedirs=None if body.posedirs is None else body.posedirs[:, mesh.kept],
        accessory_vertices=0,  # vertices of both are mixed
        bare_name="",
    )
    normals = vertex_normals(vertices, mesh.faces).astype(np.float32)
    return replace(shaped, body=coarse, vertices=vertices, normals=normals)


@functools.lru_cache(maxsize=32)
def _mesh(body: Body, count: int) -> CoarseMesh:
    """Returns the coarse mesh of a body, which is the same for all its shapes and cached."""
    return coarsen(body.template, body.faces, count, evenness=EVENNESS)


def _enclose(vertices: np.ndarray, faces: np.ndarray, skin: np.ndarray) -> np.ndarray:
    """Moves vertices along their normals until their triangles enclose the skin above them."""
    vertices, skin = np.asarray(vertices, np.float64), np.asarray(skin, np.float64)
    tree = ClosestTree(vertices, faces)
    closest = tree.closest(skin)
    heights = ((skin - closest.positions) * tree.outward(closest)).sum(axis=1)
    lift = np.zeros(len(vertices))
    np.maximum.at(lift, faces[closest.faces].reshape(-1), np.repeat(np.maximum(heights, 0), 3))
    return (vertices + lift[:, None] * vertex_normals(vertices, faces)).astype(np.float32)
