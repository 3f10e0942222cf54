"""Reduces a mesh to fewer vertices, all of them vertices of the full mesh."""

from dataclasses import dataclass

import numpy as np

from hemline.arrays import Faces, Float, Int, Vertices
from hemline.errors import BadMesh
from hemline.meshes.edge_strains import edge_lengths
from hemline.meshes.edges import rim_edges

from .collapse_kernels import collapse
from .fan_kernels import MAX_FACES, Fan, Mesh

LEAST_VERTICES = 8
"""Least number of vertices of a coarser mesh."""
RIM_WEIGHT = 100.0
"""Weight of the line of a rim relative to the surface, so that corners stay."""


@dataclass(frozen=True, eq=False)
class CoarseMesh:
    """A mesh with fewer vertices."""

    kept: Int[np.ndarray, " kept"]
    """Vertices of the full mesh that remain, ascending, int32."""
    faces: Faces
    """Triangles between them, as rows of `kept`."""
    rest_edges: Float[np.ndarray, "faces 2 2"]
    """Edges of these triangles laid flat, as in `Garment.rest_edges` [m]."""


def coarsen(
    vertices: Vertices,
    faces: Faces,
    count: int,
    *,
    rest_edges: Float[np.ndarray, "faces 2 2"] | None = None,
    bound: Int[np.ndarray, " verts"] | None = None,
    evenness: float = 0.01,
) -> CoarseMesh:
    """Collapses vertices onto neighbours, the cheapest first, until `count` are left.

    Rims keep their line, closed parts stay closed, and no triangle flips or becomes thin. Flat triangles are updated as
    well: the cloth around a removed vertex is laid flat, and new edges are measured there, so that cloth with a
    flat pattern keeps that pattern.

    Args:
        vertices: Positions [m].
        faces: Triangles with consistent winding.
        count: Vertices to keep; more stay if no other one may be removed, and fewer if a lone triangle goes.
        rest_edges: Edges of the triangles laid flat, as in `Garment.rest_edges` [m]; None: their edges in space.
        bound: Bits of the sets that a vertex belongs to, such as a pinned rim; it collapses only onto a vertex that
            belongs to all of them. None: no sets.
        evenness: Weight of even edges: the cost is the squared distance to the old planes, weighted by area, plus this
            times the fourth power of the longest new edge [m^4].

    Raises:
        BadMesh: Fewer than `LEAST_VERTICES` vertices would be left.

    Source: Garland, Heckbert, "Surface simplification using quadric error metrics", 1997. Differs: vertices collapse
        onto neighbours only, so that data of vertices stays valid; evenness; lengths along the cloth.
    """
    if count < LEAST_VERTICES:
        raise BadMesh(f"a coarser mesh has {LEAST_VERTICES} vertices or more", count, "keep a larger share")
    positions = np.asarray(vertices, np.float64)
    # about the centre, since squared distances lose digits far from the origin
    positions = np.ascontiguousarray(positions - positions.mean(axis=0))
    corner = positions[faces]
    lengths = np.linalg.norm(np.roll(corner, -1, axis=1) - corner, axis=2)
    if rest_edges is not None:
        lengths = _longer_lengths(faces, edge_lengths(rest_edges), len(positions))
    at_rim = rim_edges(faces)
    around, counts = _faces_around(faces, len(positions))
    rim = np.zeros(len(positions), np.bool_)
    rim[at_rim] = True
    sets = np.zeros(len(positions), np.int64) if bound is None else np.asarray(bound, np.int64)
    quadrics = _quadrics(positions, faces, at_rim)
    mesh = Mesh(np.array(faces, np.int64), lengths, positions, quadrics, sets, rim, around, counts)
    fan = Fan(
        np.empty(MAX_FACES, np.int64),
        np.empty(MAX_FACES + 1, np.int64),
        np.empty((MAX_FACES + 1, 2)),
        np.empty(1, np.bool_),
    )
    kept = np.ones(len(positions), np.bool_)
    collapse(mesh, float(evenness), count, fan, kept)
    remaining = mesh.faces[:, 0] >= 0
    kept[np.setdiff1d(np.flatnonzero(kept), mesh.faces[remaining])] = False  # the tip of a triangle that went
    numbers = np.cumsum(kept) - 1
    return CoarseMesh(
        np.flatnonzero(kept).astype(np.int32),
        numbers[mesh.faces[remaining]].astype(np.int32),
        _flatten(mesh.lengths[remaining]),
    )


def _longer_lengths(faces: Faces, lengths: np.ndarray, count: int) -> np.ndarray:
    """Returns lengths of edges; where two triangles disagree, the larger one."""
    ends = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    _, which = np.unique(ends @ np.array([count, 1]), return_inverse=True)
    longest = np.zeros(which.max() + 1)
    np.maximum.at(longest, which, lengths.reshape(-1))
    return longest[which].reshape(-1, 3)


def _faces_around(faces: Faces, count: int) -> tuple[np.ndarray, np.ndarray]:
    counts = np.bincount(faces.reshape(-1), minlength=count)
    around = np.full((count, MAX_FACES), -1, np.int64)
    order = np.argsort(faces.reshape(-1), kind="stable")
    first = np.cumsum(counts) - counts
    vertex = faces.reshape(-1)[order]
    place = np.arange(len(order)) - first[vertex]
    fits = place < MAX_FACES
    around[vertex[fits], place[fits]] = order[fits] // 3
    return around, counts


def _quadrics(positions: np.ndarray, faces: Faces, at_rim: np.ndarray) -> np.ndarray:
    """Returns sums of area (n, d) (n, d)^T over the planes at each vertex, upper triangles; rims add planes across."""
    corner = positions[faces]
    across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    areas = np.linalg.norm(across, axis=1) / 2
    normals = across / np.maximum(2 * areas, 1e-30)[:, None]
    quadrics = np.zeros((len(positions), 10))
    for k in range(3):
        np.add.at(quadrics, faces[:, k], _planes(normals, corner[:, 0], areas))
    if len(at_rim):
        at_vertex = np.zeros_like(positions)
        for k in range(3):
            np.add.at(at_vertex, faces[:, k], across)
        one, two = positions[at_rim[:, 0]], positions[at_rim[:, 1]]
        outward = np.cross(two - one, at_vertex[at_rim].sum(axis=1))
        outward /= np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-30)
        planes = _planes(outward, one, RIM_WEIGHT * ((two - one) ** 2).sum(axis=1))
        for k in range(2):
            np.add.at(quadrics, at_rim[:, k], planes)
    return quadrics


def _planes(normals: np.ndarray, points: np.ndarray, weights: np.ndarray) -> np.ndarray:
    a, b, c = normals.T
    d = -(normals * points).sum(axis=1)
    rows = (a * a, a * b, a * c, b * b, b * c, c * c, a * d, b * d, c * d, d * d)
    return (np.stack(rows) * weights).T


def _flatten(lengths: np.ndarray) -> np.ndarray:
    """Lays triangles of given edge lengths flat; columns are the edges from the first corner, the first along x."""
    first, across, second = lengths.T
    along = (first**2 + second**2 - across**2) / (2 * first)
    up = np.sqrt(np.maximum(second**2 - along**2, (1e-3 * second) ** 2))
    return np.stack([np.stack([first, along], 1), np.stack([np.zeros_like(first), up], 1)], axis=1)
