"""A triangle mesh as read from a file, and the welding of its seams."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Bool, Float, Int

from hemline.meshes.edges import directed_edges

WELD_TOLERANCE = 1e-5
"""Vertices nearer to each other than this fraction of the mesh's size are at one place."""

_LOOSE_PARTS = 0.1
"""A mesh with more parts than this fraction of its triangles fell apart, and is welded across gaps."""
_ROUNDS = 6
"""Number of rounds in which vertices are left apart where merging them makes a conflict."""
_WIDEST_GAP = 0.1
"""Widest gap that is welded then, as a fraction of the median length of an edge."""


@dataclass(frozen=True)
class ReadMesh:
    """A triangle mesh as a file holds it, unit as in the file."""

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
    labels: tuple[tuple[str, ...], ...] = ()
    """Names of the parts of the file: object, group and material of an OBJ; node, mesh and material of a glTF."""
    face_labels: Int[np.ndarray, " faces"] | None = None
    """Row in `labels` of each triangle; None if the file names no parts."""
    colours: Float[np.ndarray, "verts 3"] | None = None
    """Red, green and blue of each vertex, 0 to 1; None if the file has no colours."""
    marks: Mapping[str, Bool[np.ndarray, " verts"]] = field(default_factory=dict)
    """Vertices that an attribute of the file marks, such as `_PINS` of a glTF, by its name without underscores."""
    file_ids: Int[np.ndarray, " file_verts"] | None = None
    """Row in `vertices` of each vertex of the file, -1 for one that was dropped; None: all are where they were."""

    def with_faces(
        self,
        rows: Int[np.ndarray, " faces"],
        *notes: str,
        faces: Int[np.ndarray, "kept 3"] | None = None,
        merged: Int[np.ndarray, " verts"] | None = None,
    ) -> "ReadMesh":
        """Returns the mesh with some of its triangles, without vertices that none of them uses.

        Args:
            rows: The triangles that stay.
            notes: What to add to the notes.
            faces: Other corners for these triangles, for the same places of the pattern; None: as they are.
            merged: The vertex that takes the place of each vertex; None: itself.
        """
        corners = np.asarray(self.faces[rows] if faces is None else faces, np.int64)
        target = np.arange(len(self.vertices)) if merged is None else merged
        corners = target[corners]
        used = np.zeros(len(self.vertices), bool)
        used[corners] = True
        number = np.where(used, np.cumsum(used) - 1, -1)
        before = np.arange(len(self.vertices)) if self.file_ids is None else self.file_ids
        file_ids = np.where(before >= 0, number[target[before]], -1)
        return replace(
            self,
            vertices=self.vertices[used],
            faces=number[corners].astype(np.int32),
            pattern_faces=None if self.pattern_faces is None else self.pattern_faces[rows],
            face_labels=None if self.face_labels is None else self.face_labels[rows],
            colours=None if self.colours is None else self.colours[used],
            marks={name: mark[used] for name, mark in self.marks.items()},
            notes=(*self.notes, *notes),
            file_ids=file_ids,
        )


def weld(mesh: ReadMesh) -> ReadMesh:
    """Closes seams with duplicate vertices: rim vertices at one place become one, the first of them.

    A mesh that was split by an export with normals or texture seams becomes one piece of cloth again; its pattern
    (texture coordinates) stays, corner by corner. Rims are not welded where an edge would get three triangles, or a
    triangle two equal corners. A mesh of loose triangles is welded across gaps of up to a tenth of its
    median edge, too.

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
    welded = _merge(mesh, _without_conflicts(mesh.faces, target), "lay on another one")
    return _weld_gaps(welded)


def _merge(mesh: ReadMesh, target: np.ndarray, how: str) -> ReadMesh:
    """Returns the mesh with each vertex in the place of its target, if that leaves it manifold."""
    removed = int((target != np.arange(len(target))).sum())
    if not removed or not _manifold(target[mesh.faces]):
        return mesh
    note = f"seams: {removed} vertices that {how} were welded to it, vertex ids are new"
    return mesh.with_faces(np.arange(len(mesh.faces)), note, merged=target)


def _without_conflicts(faces: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Leaves vertices apart whose merging would give an edge three triangles, or a triangle two equal corners."""
    target = target.copy()
    for _ in range(_ROUNDS):
        merged = target[faces]
        pairs, count = _count_edges(merged)
        wrong = np.zeros(len(target), bool)
        wrong[pairs[count > 2]] = True
        wrong[merged[(merged == np.roll(merged, 1, axis=1)).any(axis=1)]] = True
        apart = wrong[target] & (target != np.arange(len(target)))
        if not apart.any():
            break
        target[apart] = np.flatnonzero(apart)
    return target


def _weld_gaps(mesh: ReadMesh) -> ReadMesh:
    """Welds a mesh that fell apart into loose triangles, across the widest gap that leaves it manifold."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import KDTree

    from hemline.meshes.components import components

    count = len(mesh.vertices)
    if len(np.unique(components(mesh.faces, count))) <= max(_LOOSE_PARTS * len(mesh.faces), 8):
        return mesh
    edge = float(np.median(np.linalg.norm(mesh.vertices[mesh.faces[:, 0]] - mesh.vertices[mesh.faces[:, 1]], axis=1)))
    tree = KDTree(mesh.vertices)
    for fraction in (_WIDEST_GAP, 0.03, 0.01):
        near = tree.query_pairs(fraction * edge, output_type="ndarray")
        if not len(near) or len(near) > 50 * count:
            continue
        graph = coo_matrix((np.ones(len(near), bool), near.T), (count, count))
        group = connected_components(graph, directed=False)[1]
        _, first = np.unique(group, return_index=True)
        welded = _merge(mesh, first[group], f"lay within {100 * fraction:.0f} % of an edge of another one")
        if welded is not mesh and len(welded.vertices) < 0.5 * count:
            return welded
    return mesh


def _manifold(faces: np.ndarray) -> bool:
    """Tells whether every triangle has three corners and every edge at most two triangles."""
    if (faces == np.roll(faces, 1, axis=1)).any():
        return False
    return bool(_count_edges(faces)[1].max() <= 2)


def _count_edges(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns undirected edges, and the number of triangles at each."""
    return np.unique(np.sort(directed_edges(faces), axis=1), axis=0, return_counts=True)
