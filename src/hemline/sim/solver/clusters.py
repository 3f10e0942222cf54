"""Clusters of neighbouring vertices: the coarse level of the solver's preconditioner."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, UInt

from hemline.sim.cloth.rows import Rows, incidence
from hemline.sim.cloth.sheet import Sheet

from .cluster_kernels import bisect_vertices

VERTICES_PER_CLUSTER = 80
"""Approximate number of free vertices in a cluster."""

MAX_CLUSTERS = 160
"""Maximum number of clusters: the coarse system is solved directly."""


@dataclass(frozen=True)
class Clusters:
    """A partition of the free vertices.

    Attributes:
        label: Cluster of each vertex; one past the last for pinned ones.
        members: Free vertices of each cluster.
        width: Entries in a row of the banded coarse matrix.
    """

    label: UInt[np.ndarray, " verts"]
    members: Rows
    width: int


def make_clusters(sheet: Sheet, fixed: Bool[np.ndarray, " verts"]) -> Clusters:
    """Cuts the free vertices into clusters by repeated halving along the longest path through the mesh.

    Clusters are numbered so that joined ones have close numbers (reverse Cuthill-McKee), which keeps the coarse matrix
    narrow.
    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import reverse_cuthill_mckee

    count, free = sheet.vertex_count, np.flatnonzero(~fixed)
    graph = _graph(sheet)
    parts = cut(sheet, free, int(np.clip(len(free) // VERTICES_PER_CLUSTER, 1, MAX_CLUSTERS)))
    label = np.full(count, -1, np.int64)
    for number, part in enumerate(parts):
        label[part] = number
    rows, columns = graph.nonzero()
    joined = (label[rows] >= 0) & (label[columns] >= 0)
    pairs = np.stack([label[rows[joined]], label[columns[joined]]])
    coarse = csr_array((np.ones(pairs.shape[1]), pairs), shape=(len(parts), len(parts)))
    place = np.empty(len(parts), np.int64)
    place[reverse_cuthill_mckee(coarse, symmetric_mode=True)] = np.arange(len(parts))
    band = int(np.abs(place[pairs[0]] - place[pairs[1]]).max(initial=0))
    label = np.where(label >= 0, place[label], len(parts))
    members = incidence(label[free], free, len(parts))
    return Clusters(label.astype(np.uint32), members, 3 * (band + 1))


def cut(sheet: Sheet, vertices: np.ndarray, parts: int) -> list[np.ndarray]:
    """Cuts vertices into compact parts of about equal size, by repeated halving along the longest path through each.

    Returns:
        Vertices of each part; fewer parts than requested if there are fewer vertices.
    """
    graph, members = _graph(sheet), np.sort(vertices).astype(np.int64)
    part = np.full(sheet.vertex_count, -1, np.int64)
    made = bisect_vertices(Rows(graph.indptr, graph.indices), members, parts, part)
    rows = incidence(part[members], members, made)
    return np.split(rows.columns.astype(np.int64), rows.starts[1:-1].astype(np.int64))


def _graph(sheet: Sheet):
    """Returns all couplings of the sheet, including those of bending stencils."""
    from scipy.sparse import csr_array

    count = sheet.vertex_count
    ring = csr_array((np.ones(len(sheet.ring.columns)), sheet.ring.columns, sheet.ring.starts), shape=(count, count))
    far = csr_array((np.ones(len(sheet.far.columns)), sheet.far.columns, sheet.far.starts), shape=(count, count))
    return (ring + far).tocsr()
