"""A fine garment in a coarse one: its vertices ride in the frames of the coarse vertices around them."""

from dataclasses import dataclass

import numpy as np

from hemline.arrays import Faces, Float, Int, Vertices
from hemline.garments.garment import Garment
from hemline.meshes import SurfaceWays, vertex_normals

from .embedding_kernels import carry, turned_frames

NEAR = 6
"""Coarse vertices that carry each fine one."""
REACH = 5.0
"""So many edges of the coarse garment away they are looked for."""
BLUNT = 0.03
"""Share of an edge below which a coarse vertex does not count more the nearer it is."""


@dataclass(frozen=True, eq=False)
class Embedding:
    r"""How coarse vertices carry fine ones.

    Each coarse vertex $i$ has a frame $Q_i$: its normal, and tangents that turn in its plane as its ring of neighbours
    turns, which is the rotation nearest to the least squares fit. A fine vertex that rests at $X$ goes to the weighted
    mean of where the frames around it take it:

    $$x = \sum_i w_i \, (x_i + Q_i \bar Q_i^T (X - \bar X_i)), \qquad
        w_i \propto (1 - d_i^2 / d_7^2)^2 / (d_i / \ell + 0.03)^2$$

    with a bar for what is at rest, $d_i$ the way along the cloth to the six nearest coarse vertices, $d_7$ to the
    seventh, $\ell$ the mean edge of the coarse garment. So a rigid motion of the coarse garment is passed on exactly,
    coarse vertices stay where they are, and what is fine at rest is carried along.

    Source: Sumner, Schmid, Pauly, "Embedded deformation for shape manipulation", 2007, Eq. 1 (graph of frames, weights
        of the nearest).
    Differs: frames are rotations found from the coarse mesh instead of affine unknowns; distances along the cloth, not
        through the air (a sleeve is not carried by the trunk); weights that interpolate.
    """

    faces: Faces
    """Of the coarse garment."""
    start: Int[np.ndarray, " coarse_and_one"]
    """Where the ring of each coarse vertex begins."""
    ring: Int[np.ndarray, " ring"]
    """Neighbours."""
    slopes: Float[np.ndarray, "ring 2"]
    """What each edge of a ring adds to the images of the two tangents at rest [1/m]."""
    near: Int[np.ndarray, "verts near"]
    """Coarse vertices that carry each fine one."""
    weights: Float[np.ndarray, "verts near"]
    """Their weights; rows add up to 1."""
    offsets: Float[np.ndarray, "verts near 3"]
    """The fine vertex in each of their frames at rest [m]."""

    @classmethod
    def of(cls, fine: Garment, coarse: Garment, kept: Int[np.ndarray, " coarse"]) -> "Embedding":
        """Find it, both garments as they are at rest.

        Args:
            fine: The garment that is shown.
            coarse: The one that moves.
            kept: Which vertex of the fine one each coarse vertex is.
        """
        rest = coarse.vertices.astype(np.float64)
        near, weights = _carriers(fine, kept, float(np.linalg.norm(coarse.rest_edges, axis=1).mean()))
        frames = _frames(rest, coarse.faces)
        offsets = np.einsum("vkji,vkj->vki", frames[near], fine.vertices[:, None].astype(np.float64) - rest[near])
        return cls(coarse.faces, *_rings(rest, coarse.faces, frames), near, weights, offsets)

    def carried(self, points: Float[np.ndarray, "coarse 3"]) -> Vertices:
        """The fine vertices, float32 [m].

        Args:
            points: The coarse vertices now [m].
        """
        points = np.ascontiguousarray(points, np.float64)
        frames, vertices = np.empty((len(points), 3, 3)), np.empty((len(self.near), 3), np.float32)
        normals = vertex_normals(points, self.faces).astype(np.float64)
        turned_frames(points, normals, self.start, self.ring, self.slopes, frames)
        carry(points, frames, self.near, self.weights, self.offsets, vertices)
        return vertices


def _carriers(fine: Garment, kept: np.ndarray, edge: float) -> tuple[np.ndarray, np.ndarray]:
    """The nearest few coarse vertices of each fine one along the cloth, and their weights."""
    ways = SurfaceWays.of(fine.vertices, fine.faces, fine.rest_edges)
    near, distances = ways.nearest(kept, NEAR + 1, REACH * edge)
    if (near[:, 0] < 0).any():
        near, distances = ways.nearest(kept, NEAR + 1, np.inf)
    ratio = np.minimum(
        distances / np.maximum(distances[:, -1:], 1e-9), 1.0, where=near >= 0, out=np.zeros_like(distances)
    )
    weights = ((1 - ratio**2) ** 2 + 1e-9) / (distances / edge + BLUNT) ** 2
    weights, found = weights[:, :NEAR], near[:, :NEAR] >= 0
    weights = np.where(found, weights, 0.0)
    return np.where(found, near[:, :NEAR], near[:, :1]), weights / weights.sum(axis=1, keepdims=True)


def _frames(rest: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Any two tangents and the normal of each vertex, as columns."""
    normals = vertex_normals(rest, faces).astype(np.float64)
    least = np.eye(3)[np.abs(normals).argmin(axis=1)]
    first = np.cross(normals, least)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(normals, first), normals], axis=2)


def _rings(rest: np.ndarray, faces: np.ndarray, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rings of neighbours, and what their edges add to the images of the tangents: least squares in the plane."""
    sides = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    pairs = np.unique(np.concatenate([sides, sides[:, ::-1]]), axis=0).astype(np.int64)
    start = np.concatenate([[0], np.cumsum(np.bincount(pairs[:, 0], minlength=len(rest)))])
    edges = np.einsum("eji,ej->ei", frames[pairs[:, 0], :, :2], rest[pairs[:, 1]] - rest[pairs[:, 0]])
    moments = np.full((len(rest), 2, 2), 1e-12) * np.eye(2)
    np.add.at(moments, pairs[:, 0], edges[:, :, None] * edges[:, None, :])
    slopes = np.einsum("ei,eij->ej", edges, np.linalg.inv(moments)[pairs[:, 0]])
    return start, np.ascontiguousarray(pairs[:, 1]), slopes
