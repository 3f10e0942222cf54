"""The graph of a garment that attention runs over."""

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from hemline.arrays import Faces, Float, Int
from hemline.errors import BadMesh
from hemline.meshes.edges import directed_edges

from .kernel_inputs import Rings


@dataclass(frozen=True, eq=False)
class Graph:
    """Vertices of a mesh with their neighbours. The ring of vertex i is `ring[start[i]:start[i + 1]]`, ascending."""

    start: Int[np.ndarray, " verts_and_one"]
    """Index in `ring` at which the ring of each vertex begins, int32."""
    ring: Int[np.ndarray, " edges"]
    """Vertex ids of each vertex and its neighbours, int32."""

    @classmethod
    def of(cls, faces: Faces, vertex_count: int) -> Self:
        """Connects each vertex with itself and with its neighbours along the edges of triangles.

        Args:
            faces: Triangles.
            vertex_count: Number of vertices. The ring of a vertex in no triangle holds only itself.

        Raises:
            BadMesh: A triangle names a vertex that does not exist.
        """
        if faces.size and not 0 <= int(faces.min()) <= int(faces.max()) < vertex_count:
            what = f"triangles of a graph must name some of {vertex_count} vertices"
            raise BadMesh(what, f"{faces.min()} to {faces.max()}", "count from 0")
        edges = directed_edges(faces).astype(np.int64)
        itself = np.repeat(np.arange(vertex_count), 2).reshape(-1, 2)
        pairs = np.unique(np.concatenate([edges, edges[:, ::-1], itself]), axis=0)
        start = np.searchsorted(pairs[:, 0], np.arange(vertex_count + 1))
        return cls(start.astype(np.int32), np.ascontiguousarray(pairs[:, 1], np.int32))

    @cached_property
    def rings(self) -> Rings:
        """The rings as kernels take them."""
        return Rings(self.start, self.ring)

    @property
    def vertex_count(self) -> int:
        """Number of vertices."""
        return len(self.start) - 1

    @property
    def ring_centers(self) -> Int[np.ndarray, " edges"]:
        """Vertex to whose ring each entry of `ring` belongs, int32."""
        return np.repeat(np.arange(self.vertex_count, dtype=np.int32), np.diff(self.start))

    @cached_property
    def equal_rings(self) -> tuple[Int[np.ndarray, "verts most"], Float[np.ndarray, "verts most"]]:
        """Rings as rows of equal length, filled up with the vertex itself, int64; and 1 where an entry is real."""
        size = np.diff(self.start)
        place = np.arange(len(self.ring)) - np.repeat(self.start[:-1], size)
        ring = np.repeat(np.arange(self.vertex_count, dtype=np.int64)[:, None], size.max(initial=1), axis=1)
        ring[self.ring_centers, place] = self.ring
        return ring, (np.arange(ring.shape[1]) < size[:, None]).astype(np.float32)
