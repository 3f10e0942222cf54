"""Embeds a fine garment in a coarse one: fine vertices follow the frames of the coarse vertices around them."""

from dataclasses import dataclass

import numpy as np

from hemline.arrays import Faces, Float, Int, Vertices
from hemline.garments.garment import Garment
from hemline.meshes import GeodesicMesh, vertex_normals

from .embedding_kernels import carry, turn_frames

CARRIERS = 6
"""Number of coarse vertices that carry each fine one."""
SEARCH_RADIUS = 5.0
"""Distance within which carriers are searched, in edges of the coarse garment."""
BLUNTNESS = 0.03
"""Distance below which a coarse vertex gains no more weight, in edges of the coarse garment."""


@dataclass(frozen=True, eq=False)
class Embedding:
    r"""Weights and frames by which coarse vertices carry fine ones.

    Each coarse vertex $i$ has a frame $Q_i$: its normal, and tangents that turn in its plane as its ring of neighbours
    turns, which is the rotation nearest to the least squares fit. A fine vertex that rests at $X$ goes to the weighted
    mean of the points to which the frames around it move it:

    $$x = \sum_i w_i \, (x_i + Q_i \bar Q_i^T (X - \bar X_i)), \qquad
        w_i \propto (1 - d_i^2 / d_7^2)^2 / (d_i / \ell + 0.03)^2$$

    Bars denote the garment at rest, $d_i$ the distance along the cloth to the six nearest coarse vertices, $d_7$ to the
    seventh, $\ell$ the mean edge of the coarse garment. So a rigid motion of the coarse garment is passed on exactly,
    coarse vertices stay where they are, and fine detail at rest is carried along.

    Source: Sumner, Schmid, Pauly, "Embedded deformation for shape manipulation", 2007, Eq. 1 (graph of frames, weights
        of the nearest).
    Differs: frames are rotations found from the coarse mesh instead of affine unknowns; distances along the cloth, not
        through the air (a sleeve is not carried by the trunk); weights that interpolate.
    """

    faces: Faces
    """Triangles of the coarse garment."""
    start: Int[np.ndarray, " coarse_and_one"]
    """Index at which the ring of each coarse vertex begins in `ring`."""
    ring: Int[np.ndarray, " ring"]
    """Neighbours of the coarse vertices, ring after ring."""
    slopes: Float[np.ndarray, "ring 2"]
    """Contribution of each edge of a ring to the images of the two tangents at rest [1/m]."""
    near: Int[np.ndarray, "verts near"]
    """Coarse vertices that carry each fine one."""
    weights: Float[np.ndarray, "verts near"]
    """Weights of these vertices; rows add up to 1."""
    offsets: Float[np.ndarray, "verts near 3"]
    """Position at rest of each fine vertex in the frames of its carriers [m]."""

    @classmethod
    def of(cls, fine: Garment, coarse: Garment, fine_ids: Int[np.ndarray, " coarse"]) -> "Embedding":
        """Embeds one garment in another, both as they are at rest.

        Args:
            fine: The garment that is displayed.
            coarse: The garment that moves.
            fine_ids: Number in the fine garment of each coarse vertex.
        """
        rest = coarse.vertices.astype(np.float64)
        near, weights = _carriers(fine, fine_ids, float(np.linalg.norm(coarse.rest_edges, axis=1).mean()))
        frames = _frames(rest, coarse.faces)
        offsets = np.einsum("vkji,vkj->vki", frames[near], fine.vertices[:, None].astype(np.float64) - rest[near])
        return cls(coarse.faces, *_rings(rest, coarse.faces, frames), near, weights, offsets)

    def fine_vertices(self, points: Float[np.ndarray, "coarse 3"]) -> Vertices:
        """Returns the fine vertices, float32 [m].

        Args:
            points: Current positions of the coarse vertices [m].
        """
        points = np.ascontiguousarray(points, np.float64)
        frames, vertices = np.empty((len(points), 3, 3)), np.empty((len(self.near), 3), np.float32)
        normals = vertex_normals(points, self.faces).astype(np.float64)
        turn_frames(points, normals, self.start, self.ring, self.slopes, frames)
        carry(points, frames, self.near, self.weights, self.offsets, vertices)
        return vertices


def _carriers(fine: Garment, fine_ids: np.ndarray, edge: float) -> tuple[np.ndarray, np.ndarray]:
    """Returns the nearest few coarse vertices of each fine one along the cloth, and their weights."""
    surface = GeodesicMesh.of(fine.vertices, fine.faces, fine.rest_edges)
    near, distances = surface.nearest(fine_ids, CARRIERS + 1, SEARCH_RADIUS * edge)
    if (near[:, 0] < 0).any():
        near, distances = surface.nearest(fine_ids, CARRIERS + 1, np.inf)
    ratio = np.minimum(
        distances / np.maximum(distances[:, -1:], 1e-9), 1.0, where=near >= 0, out=np.zeros_like(distances)
    )
    weights = ((1 - ratio**2) ** 2 + 1e-9) / (distances / edge + BLUNTNESS) ** 2
    weights, exists = weights[:, :CARRIERS], near[:, :CARRIERS] >= 0
    weights = np.where(exists, weights, 0.0)
    return np.where(exists, near[:, :CARRIERS], near[:, :1]), weights / weights.sum(axis=1, keepdims=True)


def _frames(rest: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Returns any two tangents and the normal of each vertex, as columns."""
    normals = vertex_normals(rest, faces).astype(np.float64)
    least = np.eye(3)[np.abs(normals).argmin(axis=1)]
    first = np.cross(normals, least)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(normals, first), normals], axis=2)


def _rings(rest: np.ndarray, faces: np.ndarray, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns rings of neighbours, and how their edges contribute to the images of the tangents, by least squares."""
    sides = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    pairs = np.unique(np.concatenate([sides, sides[:, ::-1]]), axis=0).astype(np.int64)
    start = np.concatenate([[0], np.cumsum(np.bincount(pairs[:, 0], minlength=len(rest)))])
    edges = np.einsum("eji,ej->ei", frames[pairs[:, 0], :, :2], rest[pairs[:, 1]] - rest[pairs[:, 0]])
    moments = np.full((len(rest), 2, 2), 1e-12) * np.eye(2)
    np.add.at(moments, pairs[:, 0], edges[:, :, None] * edges[:, None, :])
    slopes = np.einsum("ei,eij->ej", edges, np.linalg.inv(moments)[pairs[:, 0]])
    return start, np.ascontiguousarray(pairs[:, 1]), slopes
