"""Rope nodes as points of a garment's mesh, and kinematic nodes as points that the body carries."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Float, Int, Points, Transforms

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody


@dataclass(frozen=True, eq=False)
class NodeEmbedding:
    """Points bound barycentrically to the triangles of a mesh."""

    corners: Int[np.ndarray, "nodes 3"]
    """Vertices of each node's triangle, int32."""
    barycentric: Float[np.ndarray, "nodes 3"]
    """Barycentric weights of the corners, float64; they sum to 1."""

    @classmethod
    def at_vertices(cls, vertices: Int[np.ndarray, " nodes"]) -> "NodeEmbedding":
        """Returns points that are vertices of the mesh."""
        corners = np.repeat(np.asarray(vertices, np.int32)[:, None], 3, axis=1)
        return cls(corners, np.tile([1.0, 0.0, 0.0], (len(corners), 1)))

    def positions_on(self, vertices: Float[np.ndarray, "*frames verts 3"]) -> Float[np.ndarray, "*frames nodes 3"]:
        """Returns the points on a mesh, or on each mesh of a clip: x = sum_c b_c v_c [m], float64."""
        used, corner = np.unique(self.corners, return_inverse=True)
        weights = np.zeros((len(self.corners), len(used)))
        np.add.at(weights, (np.arange(len(self.corners))[:, None], corner.reshape(-1, 3)), self.barycentric)
        return weights @ np.asarray(vertices)[..., used, :].astype(np.float64)


@dataclass(frozen=True, eq=False)
class Carriage:
    """Points carried by the body's skeleton with the skin weights of the nearest body vertex."""

    rest: Float[np.ndarray, "kin 3"]
    """The points in the body's rest pose [m]."""
    weights: Float[np.ndarray, "kin joints"]
    """Skin weights of the points, dense, float64."""
    nearest: Int[np.ndarray, " kin"]
    """Index of the body vertex whose skin weights each point takes, int32."""
    nearest_rest: Float[np.ndarray, "kin 3"]
    """The nearest body vertices at rest, on the shape that the garment was made on [m]."""

    @classmethod
    def of(cls, rest: Points, shaped: "ShapedBody") -> "Carriage":
        """Binds points to the nearest vertices of a body at rest."""
        from scipy.spatial import KDTree

        rest = np.asarray(rest, np.float64)
        nearest = np.asarray(KDTree(shaped.vertices).query(rest)[1], np.int32)
        weights = np.zeros((len(rest), len(shaped.joints)))
        rows = np.arange(len(rest))[:, None]
        np.add.at(weights, (rows, shaped.body.weight_indices[nearest]), shaped.body.weights[nearest])
        weights /= weights.sum(1, keepdims=True)
        return cls(rest, weights, nearest, shaped.vertices[nearest].astype(np.float64))

    def rest_on(self, shaped: "ShapedBody") -> Float[np.ndarray, "kin 3"]:
        """Returns the points at rest on another shape, displaced like their body vertices [m]."""
        return self.rest + (shaped.vertices[self.nearest] - self.nearest_rest)

    def positions_in(
        self, transforms: Float[Transforms, "*frames"], rest: Float[np.ndarray, "kin 3"]
    ) -> Float[np.ndarray, "*frames kin 3"]:
        """Returns the points in one pose or in many, from skin transforms (..., joints, 3, 4) [m], float64."""
        flat = np.asarray(transforms, np.float64).reshape(*transforms.shape[:-3], transforms.shape[-3], 12)
        blended = (self.weights @ flat).reshape(*transforms.shape[:-3], len(rest), 3, 4)
        return np.einsum("...kab,kb->...ka", blended[..., :3], rest) + blended[..., 3]
