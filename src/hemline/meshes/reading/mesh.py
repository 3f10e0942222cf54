"""A triangle mesh as read from a file, and the welding of its seams."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from hemline.meshes.edges import directed_edges

WELD_TOLERANCE = 1e-5
"""Vertices nearer to each other than this fraction of the mesh's size are at one place."""


@dataclass(frozen=True)
class ReadMesh:
    """A triangle mesh as a file holds it: vertex ids and order untouched, unit as in the file."""

    vertices: Float[np.ndarray, "verts 3"]
    """Positions, float64, in the unit of the file."""
    faces: Int[np.ndarray, "faces 3"]
    """Triangles, int32, counted from 0."""
    pattern: Float[np.ndarray, "pattern_verts 2"] | None = None
    """Texture coordinates (`vt`), float64, as in the file; None if there are none."""
    pattern_faces: Int[np.ndarray, "faces 3"] | None = None
    """Row in `pattern` of each corner of `faces`; None if `pattern` is None."""
    notes: tuple[str, ...] = ()
    """Changes that the reader made on its own, in words."""


def weld(mesh: ReadMesh) -> ReadMesh:
    """Closes seams with duplicate vertices: rim vertices at one place become one, the first of them.

    A mesh that was split by an export with normals or texture seams becomes one piece of cloth again; its pattern
    (texture coordinates) stays, corner by corner. Rims that merely touch are not welded: an edge must not get three
    triangles, nor a triangle two equal corners.

    Args:
        mesh: A mesh as read from a file.

    Returns:
        The mesh, with a note on how many vertices were removed; the same mesh if there is nothing to weld, or NaN.
    """
    pairs, count = _count_edges(mesh.faces)
    rim = np.unique(pairs[count == 1]).astype(np.int64)
    if not len(rim) or not np.isfinite(mesh.vertices).all():
        return mesh
    size = float(np.ptp(mesh.vertices, axis=0).max())
    place = np.round(mesh.vertices[rim] / max(WELD_TOLERANCE * size, 1e-300)).astype(np.int64)
    _, first, inverse = np.unique(place, axis=0, return_index=True, return_inverse=True)
    target = np.arange(len(mesh.vertices))
    target[rim] = rim[first][inverse.reshape(-1)]
    removed = target != np.arange(len(target))
    faces = target[mesh.faces]
    if not removed.any() or not _manifold(faces):
        return mesh
    number = np.cumsum(~removed) - 1
    note = f"seams: {int(removed.sum())} vertices that lay on another one were welded to it, vertex ids are new"
    return replace(
        mesh, vertices=mesh.vertices[~removed], faces=number[faces].astype(np.int32), notes=(*mesh.notes, note)
    )


def _manifold(faces: np.ndarray) -> bool:
    """Tells whether every triangle has three corners and every edge at most two triangles."""
    if (faces == np.roll(faces, 1, axis=1)).any():
        return False
    return bool(_count_edges(faces)[1].max() <= 2)


def _count_edges(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns undirected edges, and the number of triangles at each."""
    return np.unique(np.sort(directed_edges(faces), axis=1), axis=0, return_counts=True)
