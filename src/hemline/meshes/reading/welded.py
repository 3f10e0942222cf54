"""Vertices at one place made one."""

from dataclasses import replace

import numpy as np

from hemline.meshes.edges import directed_edges

from .mesh import ReadMesh

NEAR = 1e-5
"""Vertices that are nearer to each other than this share of the mesh's size are at one place."""


def welded(mesh: ReadMesh) -> ReadMesh:
    """Close seams along which vertices stand twice: rim vertices at one place become one, the first of them.

    What an export with split normals or texture seams leaves behind is one piece of cloth again; its pattern (texture
    coordinates) stays as it is, corner by corner. Rims that merely touch are left alone: nothing is welded where an
    edge would have three triangles, or a triangle two equal corners.

    Args:
        mesh: As read.

    Returns:
        The mesh, with a note that says how many vertices went; itself where there is nothing to weld, or NaN.
    """
    pairs, count = _edges_counted(mesh.faces)
    rim = np.unique(pairs[count == 1]).astype(np.int64)
    if not len(rim) or not np.isfinite(mesh.vertices).all():
        return mesh
    size = float(np.ptp(mesh.vertices, axis=0).max())
    place = np.round(mesh.vertices[rim] / max(NEAR * size, 1e-300)).astype(np.int64)
    _, first, inverse = np.unique(place, axis=0, return_index=True, return_inverse=True)
    target = np.arange(len(mesh.vertices))
    target[rim] = rim[first][inverse.reshape(-1)]
    gone = target != np.arange(len(target))
    faces = target[mesh.faces]
    if not gone.any() or not _manifold(faces):
        return mesh
    number = np.cumsum(~gone) - 1
    note = f"seams: {int(gone.sum())} vertices that lay on another one were welded to it, vertex ids are new"
    return replace(mesh, vertices=mesh.vertices[~gone], faces=number[faces].astype(np.int32), notes=(*mesh.notes, note))


def _manifold(faces: np.ndarray) -> bool:
    """Whether every triangle has three corners and every edge at most two triangles."""
    if (faces == np.roll(faces, 1, axis=1)).any():
        return False
    return bool(_edges_counted(faces)[1].max() <= 2)


def _edges_counted(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Edges, whichever way their triangles are wound, and the triangles at each."""
    return np.unique(np.sort(directed_edges(faces), axis=1), axis=0, return_counts=True)
