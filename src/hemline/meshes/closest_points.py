"""Nearest points of a triangle mesh, and signed distances to it."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hemline.arrays import Faces, Float, Int, Points, Vertices
from hemline.errors import BadMesh

from .closest_kernels import BoxTree, fill_boxes, nearest_points, order_by_halves
from .normals import face_normals

_LEAF = 4


@dataclass(frozen=True)
class ClosestPoints:
    """The nearest point on a mesh for each query."""

    faces: Int[np.ndarray, " points"]
    """Nearest triangle, int32."""
    weights: Float[np.ndarray, "points 3"]
    """Barycentric weights of the nearest point, float64."""
    positions: Float[np.ndarray, "points 3"]
    """Nearest points [m]."""
    distances: Float[np.ndarray, " points"]
    """Unsigned distances [m]."""


@dataclass(frozen=True)
class ClosestTree:
    """A search tree of a mesh for many nearest-point queries; for offline work, in float64.

    Raises:
        BadMesh: The mesh has no triangles.
    """

    vertices: Float[np.ndarray, "verts 3"]
    """Positions, float64 [m]."""
    faces: Faces
    """Triangles, at least one."""

    def __post_init__(self) -> None:
        if not len(self.faces):
            raise BadMesh("a mesh without triangles has no nearest point", "0 triangles", "give a mesh with triangles")

    @cached_property
    def corners(self) -> Float[np.ndarray, "faces 3 3"]:
        """Corner positions of each triangle [m]."""
        return np.ascontiguousarray(self.vertices[self.faces], np.float64)

    @cached_property
    def _tree(self) -> BoxTree:
        leaves = 1 << max(0, int(np.ceil(np.log2(max(1, len(self.faces) / _LEAF)))))
        leaf = -(-len(self.faces) // leaves)
        order = order_by_halves(self.corners.mean(axis=1), leaf, leaves)
        low, high = np.empty((2 * leaves - 1, 3)), np.empty((2 * leaves - 1, 3))
        tree = BoxTree(self.corners, order, leaf, low, high)
        fill_boxes(tree)
        return tree

    @cached_property
    def _pseudonormals(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Pseudo-normals of triangles, of edges (opposite to each corner) and of vertices (weighted by angle)."""
        normal = face_normals(self.corners.reshape(-1, 3), np.arange(self.faces.size).reshape(-1, 3))
        pairs = np.sort(np.stack([self.faces[:, [1, 2]], self.faces[:, [2, 0]], self.faces[:, [0, 1]]], 1), axis=2)
        key = pairs[..., 0].astype(np.int64) * len(self.vertices) + pairs[..., 1]
        _, edge = np.unique(key.reshape(-1), return_inverse=True)
        at_edge = _sum_at(edge, np.repeat(normal, 3, axis=0), edge.max() + 1)
        at_vertex = np.zeros((len(self.vertices), 3))
        for corner in range(3):
            one = self.corners[:, (corner + 1) % 3] - self.corners[:, corner]
            two = self.corners[:, (corner + 2) % 3] - self.corners[:, corner]
            angle = np.arctan2(np.linalg.norm(np.cross(one, two), axis=1), (one * two).sum(axis=1))
            at_vertex += _sum_at(self.faces[:, corner], normal * angle[:, None], len(self.vertices))
        return normal, at_edge[edge].reshape(-1, 3, 3), at_vertex

    def closest(self, points: Points) -> ClosestPoints:
        """Finds the nearest point of the mesh for each point; exact.

        Args:
            points: Queries [m].

        Returns:
            Triangles, barycentric weights, positions and distances.
        """
        points = np.ascontiguousarray(points, np.float64)
        face = np.empty(len(points), np.int32)
        weights, squared = np.empty((len(points), 3)), np.empty(len(points))
        nearest_points(points, self._tree, face, weights, squared)
        return ClosestPoints(face, weights, np.einsum("pc,pcx->px", weights, self.corners[face]), np.sqrt(squared))

    def outward(self, closest: ClosestPoints) -> Float[np.ndarray, "points 3"]:
        """Returns the unit pseudo-normals at nearest points, of the triangle, edge or vertex that each lies on.

        Source: Bærentzen, Aanæs, "Signed distance computation using the angle weighted pseudonormal", 2005.
        """
        normal, at_edge, at_vertex = self._pseudonormals
        zero = closest.weights <= 0
        result = normal[closest.faces].copy()
        on_edge = zero.sum(axis=1) == 1
        result[on_edge] = at_edge[closest.faces[on_edge], zero[on_edge].argmax(axis=1)]
        on_vertex = zero.sum(axis=1) == 2
        corner = (~zero[on_vertex]).argmax(axis=1)
        result[on_vertex] = at_vertex[self.faces[closest.faces[on_vertex], corner]]
        return result / np.maximum(np.linalg.norm(result, axis=1, keepdims=True), 1e-30)

    def signed_distances(self, points: Points) -> Float[np.ndarray, " points"]:
        """Returns distances to a closed mesh, negative behind its nearest place [m].

        For a mesh that does not pass through itself, such as a body at rest, negative means inside; a posed body needs
        `collide.inside`.
        """
        closest = self.closest(points)
        side = ((points - closest.positions) * self.outward(closest)).sum(axis=1)
        return np.where(side < 0, -closest.distances, closest.distances)


def closest_points_on_mesh(points: Points, vertices: Vertices, faces: Faces) -> ClosestPoints:
    """Finds the nearest point of a mesh for each point; exact. For several calls, keep a `ClosestTree`.

    Args:
        points: Queries [m].
        vertices: Positions of the mesh [m].
        faces: Triangles of the mesh.

    Returns:
        Triangles, barycentric weights, positions and distances.

    Raises:
        BadMesh: The mesh has no triangles.
    """
    return ClosestTree(np.asarray(vertices, np.float64), faces).closest(points)


def _sum_at(index: np.ndarray, vectors: np.ndarray, count: int) -> np.ndarray:
    """Returns the sums of vectors with the same index."""
    return np.stack([np.bincount(index, vectors[:, axis], count) for axis in range(3)], axis=1)
