"""Samples points evenly over a surface, and finds those nearest to each vertex along it."""

from dataclasses import dataclass

import numpy as np

from hemline.arrays import Faces, Float, Int, Vertices
from hemline.errors import BadMesh

from .geodesic_distances import faces_around, opposite_lengths
from .marching_kernels import list_nearest, sample_points


@dataclass(frozen=True)
class GeodesicMesh:
    """A mesh prepared for geodesic queries along its surface."""

    faces: Faces
    lengths: Float[np.ndarray, "faces 3"]
    """Length of the edge opposite to each corner [m]."""
    face_start: Int[np.ndarray, " verts_and_one"]
    """Where the faces around each vertex begin in `face_list`."""
    face_list: Int[np.ndarray, " corners"]
    """Faces around each vertex."""

    @classmethod
    def of(
        cls, vertices: Vertices, faces: Faces, rest_edges: Float[np.ndarray, "faces 2 2"] | None = None
    ) -> "GeodesicMesh":
        """Prepares a mesh.

        Args:
            vertices: Positions [m].
            faces: Triangles.
            rest_edges: The flat rest triangles; where given, paths are measured on the pattern [m].
        """
        lengths = np.ascontiguousarray(opposite_lengths(vertices, faces, rest_edges), np.float64)
        start, around = faces_around(faces, len(vertices))
        return cls(np.ascontiguousarray(faces, np.int32), lengths, start, around)

    @property
    def vertex_count(self) -> int:
        """Number of vertices."""
        return len(self.face_start) - 1

    def sample(self, count: int, first: Int[np.ndarray, " first"] | None = None) -> Int[np.ndarray, " points"]:
        """Samples points along the surface by farthest-point sampling.

        Each next point is the vertex that is farthest from all before it, so that any number of first points of the
        sequence is spread evenly.

        Args:
            count: Number of points, those given included.
            first: Vertices that are points already.

        Returns:
            Vertex ids, those given first, int64.

        Raises:
            BadMesh: `count` exceeds the number of vertices.

        Source: Eldar, Lindenbaum, Porat, Zeevi, "The farthest point strategy for progressive image sampling", 1997;
            distances by fast marching: Kimmel, Sethian, "Computing geodesic paths on manifolds", 1998.
        """
        if count > self.vertex_count:
            raise BadMesh("as many points as vertices at most", f"{count} of {self.vertex_count}", "ask for fewer")
        given = np.zeros(0, np.int64) if first is None else np.asarray(first, np.int64)
        points = np.zeros(max(count, len(given)), np.int64)
        points[: len(given)] = given
        sample_points(self.faces, self.lengths, self.face_start, self.face_list, len(given), points)
        return points

    def nearest(
        self, points: Int[np.ndarray, " points"], count: int, reach: float
    ) -> tuple[Int[np.ndarray, "verts near"], Float[np.ndarray, "verts near"]]:
        """Finds the nearest few points of each vertex along the surface.

        Args:
            points: Vertex ids.
            count: Number of points for each vertex.
            reach: Search radius [m].

        Returns:
            Numbers of points (int64, -1 for none) and distances [m] (infinite for none), ascending.
        """
        near = np.empty((self.vertex_count, count), np.int64)
        distances = np.empty((self.vertex_count, count))
        points = np.asarray(points, np.int64)
        list_nearest(self.faces, self.lengths, self.face_start, self.face_list, points, reach, near, distances)
        return near, distances
