"""The solver's order of vertices: cluster by cluster, so that each thread works on memory of its own."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, UInt

from hemline.sim.cloth.rows import Rows
from hemline.sim.cloth.sheet import Sheet

from .clusters import make_clusters

SLOTS_PER_LINE = 4
"""Vertices of a solver's vector in one cache line; clusters begin at a multiple of it."""


@dataclass(frozen=True)
class Layout:
    """Places ("slots") of the vertices in the solver's vectors, and the pattern of its matrix in that order.

    Slots without a vertex fill up a cluster's last cache line; their rows are empty. Fixed vertices come after all
    clusters.

    Attributes:
        slot: Slot of each vertex.
        vertex: Vertex in each slot; 0 for an empty slot.
        begin: First slot of each cluster.
        end: One past the last slot of each cluster that has a vertex.
        cluster: Cluster of each slot; the number of clusters for fixed vertices and empty slots.
        width: Entries in a row of the banded coarse matrix.
        ring: The sheet's `ring`, by slots.
        ring_bending: The sheet's `ring_bending`, in that order.
        edge_slots: Entries (i, j) and (j, i) of each edge in that order.
        far: The sheet's `far`, by slots.
        far_bending: The sheet's `far_bending`, in that order.
    """

    slot: UInt[np.ndarray, " verts"]
    vertex: UInt[np.ndarray, " slots"]
    begin: UInt[np.ndarray, " clusters"]
    end: UInt[np.ndarray, " clusters"]
    cluster: UInt[np.ndarray, " slots"]
    width: int
    ring: Rows
    ring_bending: Float[np.ndarray, " ring"]
    edge_slots: UInt[np.ndarray, "edges 2"]
    far: Rows
    far_bending: Float[np.ndarray, " far"]


class Pattern(NamedTuple):
    """A layout as kernels take it. It is flat because tuples within tuples cost microseconds to unpack."""

    slot: UInt[np.ndarray, " verts"]
    vertex: UInt[np.ndarray, " slots"]
    begin: UInt[np.ndarray, " clusters"]
    end: UInt[np.ndarray, " clusters"]
    cluster: UInt[np.ndarray, " slots"]
    ring_starts: UInt[np.ndarray, " slots_and_one"]
    ring: UInt[np.ndarray, " ring"]
    far_starts: UInt[np.ndarray, " slots_and_one"]
    far: UInt[np.ndarray, " far"]
    far_bending: Float[np.ndarray, " far"]

    @classmethod
    def from_layout(cls, layout: Layout) -> "Pattern":
        """Returns the pattern of a layout."""
        one, two = layout.ring, layout.far
        return cls(layout.slot, layout.vertex, layout.begin, layout.end, layout.cluster, *one, *two, layout.far_bending)


def make_layout(sheet: Sheet, fixed: Bool[np.ndarray, " verts"]) -> Layout:
    """Lays out the rows of a sheet, some of whose vertices are fixed."""
    clusters = make_clusters(sheet, fixed)
    members = clusters.members
    sizes = np.diff(members.starts.astype(np.int64))
    lines = (sizes + SLOTS_PER_LINE - 1) // SLOTS_PER_LINE * SLOTS_PER_LINE
    begin = np.cumsum(lines) - lines
    fixed_vertices = np.flatnonzero(fixed)
    free_slots, count = int(lines.sum()), int(lines.sum()) + len(fixed_vertices)
    slot = np.empty(sheet.vertex_count, np.int64)
    slot[members.columns] = np.repeat(begin - members.starts[:-1], sizes) + np.arange(len(members.columns))
    slot[fixed_vertices] = free_slots + np.arange(len(fixed_vertices))
    vertex, cluster = np.zeros(count, np.uint32), np.full(count, len(sizes), np.uint32)
    vertex[slot] = np.arange(sheet.vertex_count)
    cluster[slot] = clusters.label
    ring, ring_order = _reorder(sheet.ring, slot, count)
    far, far_order = _reorder(sheet.far, slot, count)
    place = np.empty(len(ring_order), np.uint32)
    place[ring_order] = np.arange(len(ring_order))
    return Layout(
        slot=slot.astype(np.uint32),
        vertex=vertex,
        begin=begin.astype(np.uint32),
        end=(begin + sizes).astype(np.uint32),
        cluster=cluster,
        width=clusters.width,
        ring=ring,
        ring_bending=sheet.ring_bending[ring_order],
        edge_slots=place[sheet.edge_slots],
        far=far,
        far_bending=sheet.far_bending[far_order].astype(np.float32),
    )


def _reorder(rows: Rows, slot: np.ndarray, count: int) -> tuple[Rows, np.ndarray]:
    """Returns the pattern by slots, and the old number of each new entry."""
    lengths = np.diff(rows.starts.astype(np.int64))
    row, column = slot[np.repeat(np.arange(len(lengths)), lengths)], slot[rows.columns]
    order = np.lexsort((column, row))
    starts = np.concatenate([[0], np.cumsum(np.bincount(row, minlength=count))])
    return Rows(starts.astype(np.uint32), column[order].astype(np.uint32)), order
