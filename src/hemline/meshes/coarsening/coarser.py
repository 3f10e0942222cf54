"""A mesh of fewer vertices, all of them vertices of the full one."""

from dataclasses import dataclass

import numpy as np

from hemline.arrays import Faces, Float, Int, Vertices
from hemline.errors import BadMesh
from hemline.meshes.edge_strains import edge_lengths
from hemline.meshes.edges import directed_edges

from .collapse_kernels import collapse
from .fan_kernels import MOST, Fan, Mesh

LEAST = 8
"""Vertices that a coarser mesh has at least."""
RIM = 100.0
"""How much more the line of a rim counts than the surface: corners stay."""


@dataclass(frozen=True, eq=False)
class CoarserMesh:
    """What is left of a mesh."""

    kept: Int[np.ndarray, " kept"]
    """The vertices of the full mesh that are left, ascending, int32."""
    faces: Faces
    """Triangles between them, numbers of `kept`."""
    rest_edges: Float[np.ndarray, "faces 2 2"]
    """Those triangles laid flat, as `Garment.rest_edges` [m]."""


def coarser(
    vertices: Vertices,
    faces: Faces,
    count: int,
    *,
    rest_edges: Float[np.ndarray, "faces 2 2"] | None = None,
    bound: Int[np.ndarray, " verts"] | None = None,
    evenness: float = 0.01,
) -> CoarserMesh:
    """Draw vertices onto neighbours, the cheapest first, until so many are left.

    Rims keep their line, what is closed stays closed, no triangle turns over or becomes thin. Flat triangles are kept
    along: the cloth around a vertex that goes is laid flat, and new edges are measured there. So cloth that is cut flat
    has the same cut afterwards.

    Args:
        vertices: Positions [m].
        faces: Triangles with consistent winding.
        count: Vertices to keep; more stay where no other one may go.
        rest_edges: The triangles laid flat, as `Garment.rest_edges` [m]; None: as they are in space.
        bound: Bits of what a vertex belongs to, such as a pinned rim: it goes only onto one that belongs to all of
            that. None: nothing is bound.
        evenness: How much even edges count: cost is the squared distance to the old planes, weighted by area, plus this
            times the fourth power of the longest new edge [m^4].

    Raises:
        BadMesh: Fewer than `MIN_BLUR` vertices would be left.

    Source: Garland, Heckbert, "Surface simplification using quadric error metrics", 1997. Differs: vertices go onto
        neighbours only, so that what is known of a vertex stays known; evenness; lengths along the cloth.
    """
    if count < LEAST:
        raise BadMesh(f"a coarser mesh has {LEAST} vertices or more", count, "keep a larger share")
    positions = np.asarray(vertices, np.float64)
    # about the middle: squared distances lose their digits far from the origin
    positions = np.ascontiguousarray(positions - positions.mean(axis=0))
    corner = positions[faces]
    lengths = np.linalg.norm(np.roll(corner, -1, axis=1) - corner, axis=2)
    if rest_edges is not None:
        lengths = _agreed(faces, edge_lengths(rest_edges), len(positions))
    rim_edges = _rim_edges(faces)
    around, counts = _faces_around(faces, len(positions))
    rim = np.zeros(len(positions), np.bool_)
    rim[rim_edges] = True
    held = np.zeros(len(positions), np.int64) if bound is None else np.asarray(bound, np.int64)
    quadrics = _quadrics(positions, faces, rim_edges)
    mesh = Mesh(np.array(faces, np.int64), lengths, positions, quadrics, held, rim, around, counts)
    fan = Fan(np.empty(MOST, np.int64), np.empty(MOST + 1, np.int64), np.empty((MOST + 1, 2)), np.empty(1, np.bool_))
    kept = np.ones(len(positions), np.bool_)
    collapse(mesh, float(evenness), count, fan, kept)
    numbers = np.cumsum(kept) - 1
    there = mesh.faces[:, 0] >= 0
    return CoarserMesh(
        np.flatnonzero(kept).astype(np.int32),
        numbers[mesh.faces[there]].astype(np.int32),
        _laid_flat(mesh.lengths[there]),
    )


def _agreed(faces: Faces, lengths: np.ndarray, count: int) -> np.ndarray:
    """Lengths of edges, of two triangles that do not agree the longer one."""
    ends = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    _, which = np.unique(ends @ np.array([count, 1]), return_inverse=True)
    longest = np.zeros(which.max() + 1)
    np.maximum.at(longest, which, lengths.reshape(-1))
    return longest[which].reshape(-1, 3)


def _rim_edges(faces: Faces) -> np.ndarray:
    """Directed edges of one triangle only."""
    directed = directed_edges(faces)
    _, index, count = np.unique(np.sort(directed, axis=1), axis=0, return_index=True, return_counts=True)
    return directed[index[count == 1]]


def _faces_around(faces: Faces, count: int) -> tuple[np.ndarray, np.ndarray]:
    counts = np.bincount(faces.reshape(-1), minlength=count)
    around = np.full((count, MOST), -1, np.int64)
    order = np.argsort(faces.reshape(-1), kind="stable")
    first = np.cumsum(counts) - counts
    vertex = faces.reshape(-1)[order]
    place = np.arange(len(order)) - first[vertex]
    fits = place < MOST
    around[vertex[fits], place[fits]] = order[fits] // 3
    return around, counts


def _quadrics(positions: np.ndarray, faces: Faces, rim_edges: np.ndarray) -> np.ndarray:
    """Sums of area (n, d) (n, d)^T over the planes at each vertex, upper triangles; rims have planes across."""
    corner = positions[faces]
    across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    areas = np.linalg.norm(across, axis=1) / 2
    normals = across / np.maximum(2 * areas, 1e-30)[:, None]
    quadrics = np.zeros((len(positions), 10))
    for k in range(3):
        np.add.at(quadrics, faces[:, k], _planes(normals, corner[:, 0], areas))
    if len(rim_edges):
        at_vertex = np.zeros_like(positions)
        for k in range(3):
            np.add.at(at_vertex, faces[:, k], across)
        one, two = positions[rim_edges[:, 0]], positions[rim_edges[:, 1]]
        outward = np.cross(two - one, at_vertex[rim_edges].sum(axis=1))
        outward /= np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-30)
        planes = _planes(outward, one, RIM * ((two - one) ** 2).sum(axis=1))
        for k in range(2):
            np.add.at(quadrics, rim_edges[:, k], planes)
    return quadrics


def _planes(normals: np.ndarray, points: np.ndarray, weights: np.ndarray) -> np.ndarray:
    a, b, c = normals.T
    d = -(normals * points).sum(axis=1)
    rows = (a * a, a * b, a * c, b * b, b * c, c * c, a * d, b * d, c * d, d * d)
    return (np.stack(rows) * weights).T


def _laid_flat(lengths: np.ndarray) -> np.ndarray:
    """Triangles of three edges, the first along x: columns are the edges from the first corner."""
    first, across, second = lengths.T
    along = (first**2 + second**2 - across**2) / (2 * first)
    up = np.sqrt(np.maximum(second**2 - along**2, (1e-3 * second) ** 2))
    return np.stack([np.stack([first, along], 1), np.stack([np.zeros_like(first), up], 1)], axis=1)
