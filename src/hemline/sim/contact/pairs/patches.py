"""Small, fixed patches of the mesh: the search for self-contact first compares patches."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, UInt

from hemline.meshes import components
from hemline.sim.cloth.rows import Rows, incidence
from hemline.sim.cloth.sheet import Sheet
from hemline.sim.solver.clusters import cut

from .lane_kernels import LANES, NOBODY, ROWS, Lanes

VERTICES_PER_PATCH = 6
"""Approximate number of vertices in a patch."""


def lanes_of(rows: Rows) -> Lanes:
    """Cuts each row into blocks, with room for what `fill_lanes` writes."""
    count = np.diff(rows.starts.astype(np.int64))
    starts = np.concatenate([[0], np.cumsum(-(-count // LANES))])
    elements = np.full((starts[-1], LANES), NOBODY)
    place = np.repeat(LANES * starts[:-1] - rows.starts[:-1].astype(np.int64), count) + np.arange(count.sum())
    elements.ravel()[place] = rows.columns
    return Lanes(starts.astype(np.uint32), elements, np.empty((len(elements), ROWS, LANES), np.float32))


@dataclass(frozen=True)
class ClothPatches:
    """A partition of vertices, edges and triangles.

    Attributes:
        vertices: Vertices of each patch.
        edges: Edges of each patch, which contains their first vertex.
        faces: Triangles of each patch, which contains their first corner.
        joined: 1 for two patches that are the same, joined by an edge, or both joined to a third one.
        opposite: Third vertex of the one or two triangles at each edge; the edge's own first vertex for none.
        radius: Half of the maximum thickness of each vertex [m].
    """

    vertices: Rows
    edges: Rows
    faces: Rows
    joined: UInt[np.ndarray, "patches patches"]
    opposite: UInt[np.ndarray, "edges 2"]
    radius: Float[np.ndarray, " verts"]

    @property
    def count(self) -> int:
        """Number of patches."""
        return len(self.joined)


def make_patches(sheet: Sheet, thickness: float) -> ClothPatches:
    """Cuts a sheet into patches.

    Args:
        sheet: The cloth.
        thickness: Distance that the cloth keeps from itself [m]; less where its edges are shorter than twice that.
    """
    from scipy.sparse import csr_array

    # a patch lies within one piece of cloth: only there do equal normals mean that nothing meets
    piece = components(sheet.faces.astype(np.int32), sheet.vertex_count)
    pieces = [np.flatnonzero(piece == number) for number in range(int(piece.max()) + 1)]
    parts = [part for piece in pieces for part in cut(sheet, piece, max(1, len(piece) // VERTICES_PER_PATCH))]
    label = np.empty(sheet.vertex_count, np.int64)
    for number, part in enumerate(parts):
        label[part] = number
    count = len(parts)
    joined = np.eye(count, dtype=np.uint8)
    first, second = label[sheet.edges].T
    joined[first, second] = joined[second, first] = 1
    near: Any = csr_array(joined.astype(np.int32))
    joined = (near @ near).toarray() > 0
    shortest = np.full(sheet.vertex_count, np.inf)
    for end in (0, 1):
        np.minimum.at(shortest, sheet.edges[:, end], sheet.edge_length)
    return ClothPatches(
        vertices=incidence(label, np.arange(len(label)), count),
        edges=incidence(first, np.arange(len(first)), count),
        faces=incidence(label[sheet.faces[:, 0]], np.arange(len(sheet.faces)), count),
        joined=joined.astype(np.uint8),
        opposite=_opposite(sheet),
        radius=np.minimum(thickness, 0.5 * shortest) / 2,
    )


def _opposite(sheet: Sheet) -> np.ndarray:
    """Returns the third vertices of the triangles at each edge."""
    starts, codes = sheet.edge_corners.starts, sheet.edge_corners.columns.astype(np.int64)
    corner = 3 - codes % 9 // 3 - codes % 3
    third = sheet.faces[codes // 9, corner]
    result = np.repeat(sheet.edges[:, :1], 2, axis=1).astype(np.uint32)
    row = np.repeat(np.arange(len(sheet.edges)), np.diff(starts))
    place = np.arange(len(codes)) - starts[:-1][row]
    first_two = place < 2
    result[row[first_two], place[first_two]] = third[first_two]
    return result
