"""Data of a garment that the whole-cloth step reads: control vertices spread over it, and its edges."""

from itertools import combinations
from typing import NamedTuple

import numpy as np

from hemline.arrays import Faces, Float, Int, Vertices
from hemline.meshes import GeodesicMesh, geodesic_distances, rest_lengths, vertex_normals

CONTROLS_PER_VERTEX = 4
"""Control vertices that move a vertex."""
SEARCH_RATIO = 4.0
"""Radius in which control vertices are searched for, over the largest distance to the nearest one."""
BLOCK_SIZE = 64
"""Vertices in a block of fine edges."""
_CANDIDATES = 16
"""Control vertices searched for around each vertex, enough to include those of all neighbouring cells."""


class CoarseModel(NamedTuple):
    """Control vertices, edges between them, and samples, as kernels take them. Vertices are in the kernels' order."""

    controls: Int[np.ndarray, " controls"]
    """Vertex of each control vertex."""
    edges: Int[np.ndarray, "coarse 2"]
    """Neighbouring control vertices, numbers of controls."""
    lengths: Float[np.ndarray, " coarse"]
    """Distance between the two along the cloth at rest [m]."""
    free: Float[np.ndarray, " controls"]
    """1, or 0 for pinned ones."""
    weight_ids: Int[np.ndarray, "verts near"]
    """The control vertices that move each vertex."""
    weights: Float[np.ndarray, "verts near"]
    """Weights of these control vertices, with sum 1."""
    samples: Int[np.ndarray, " samples"]
    """Vertices that are kept over the skin."""
    triangles: Int[np.ndarray, "samples 3"]
    """Three control vertices around each sample, counter-clockwise from outside: the cloth's outer side there."""


class FineModel(NamedTuple):
    """All edges of the garment, block by block of vertices, colour by colour in each block."""

    edges: Int[np.ndarray, "edges 2"]
    lengths: Float[np.ndarray, " edges"]
    """Length of each edge at rest, on the pattern [m]."""
    free: Float[np.ndarray, " verts"]
    """1, or 0 for pinned vertices."""
    block_start: Int[np.ndarray, " blocks_and_one"]
    """Where the edges of each block begin: those whose first vertex is in it."""
    beside_start: Int[np.ndarray, " blocks_and_one"]
    """Where the blocks beside each block begin in `beside`."""
    beside: Int[np.ndarray, " beside"]
    """Blocks with edges that end in each block, the block itself included."""
    block_size: int


def coarse_model(
    vertices: Vertices,
    faces: Faces,
    rest_edges: Float[np.ndarray, "faces 2 2"],
    pinned: Int[np.ndarray, " pins"],
    control_count: int,
    sample_count: int,
) -> CoarseModel:
    """Spreads control vertices and samples over a garment.

    Args:
        vertices: The garment at rest [m].
        faces: Its triangles, counter-clockwise from outside.
        rest_edges: Edges of its flat triangles [m].
        pinned: Vertices that the body carries.
        control_count: Number of control vertices, at most one a vertex.
        sample_count: Number of samples, which continue the sequence of control vertices.
    """
    count = len(vertices)
    paths = GeodesicMesh.of(vertices, faces, rest_edges)
    points = paths.sample(min(control_count + sample_count, count))
    controls = points[:control_count]
    nearest = geodesic_distances(vertices, faces, controls, rest_edges=rest_edges)
    farthest = nearest[np.isfinite(nearest)].max(initial=1e-6)
    near, distances = paths.nearest(controls, _CANDIDATES, SEARCH_RATIO * farthest)
    ids, weights = _weights(near, distances)
    edges, lengths = _coarse_edges(faces, controls, near, distances)
    if len(pinned):
        # from the pins downwards, so that a sweep carries a pull all the way
        depth = geodesic_distances(vertices, faces, pinned, rest_edges=rest_edges)[controls]
        order = np.argsort(depth[edges].sum(axis=1), kind="stable")
        edges, lengths = edges[order], lengths[order]
    samples = points[-min(sample_count, len(points)) :]
    triangles = _triangles(vertices, faces, controls[ids[samples]])
    return CoarseModel(
        controls=controls.astype(np.int32),
        edges=edges.astype(np.int32),
        lengths=lengths.astype(np.float32),
        free=(~np.isin(controls, pinned)).astype(np.float32),
        weight_ids=ids.astype(np.int32),
        weights=weights.astype(np.float32),
        samples=samples.astype(np.int32),
        triangles=triangles.astype(np.int32),
    )


def fine_model(faces: Faces, rest_edges: Float[np.ndarray, "faces 2 2"], pinned: Int[np.ndarray, " pins"]) -> FineModel:
    """Collects the edges of a garment, sorted by blocks of vertices.

    Args:
        faces: Triangles.
        rest_edges: Edges of the flat triangles [m].
        pinned: Vertices that the body carries.
    """
    count = int(faces.max()) + 1
    edges, lengths = rest_lengths(faces, rest_edges)
    inner = ~np.isin(edges, pinned).all(axis=1)
    edges, lengths = edges[inner], lengths[inner]
    blocks = -(-count // BLOCK_SIZE)
    order = sweep_order(edges, count)
    edges, lengths = edges[order], lengths[order]
    own, other = edges[:, 0] // BLOCK_SIZE, edges[:, 1] // BLOCK_SIZE
    pairs = np.unique(np.concatenate([np.stack([own, own], 1), np.stack([other, own], 1)]), axis=0)
    free = np.ones(count, np.float32)
    free[pinned] = 0
    return FineModel(
        edges=edges.astype(np.int32),
        lengths=lengths.astype(np.float32),
        free=free,
        block_start=np.searchsorted(own, np.arange(blocks + 1)).astype(np.int32),
        beside_start=np.searchsorted(pairs[:, 0], np.arange(blocks + 1)).astype(np.int32),
        beside=pairs[:, 1].astype(np.int32),
        block_size=BLOCK_SIZE,
    )


def sweep_order(edges: Int[np.ndarray, "edges 2"], count: int) -> Int[np.ndarray, " edges"]:
    """Returns the order in which sweeps go over edges: block by block of vertices, colour by colour in each block.

    Args:
        edges: Pairs of vertices.
        count: Number of vertices.
    """
    return np.lexsort((_colours(edges, count), edges[:, 0] // BLOCK_SIZE))


def _colours(edges: np.ndarray, count: int) -> np.ndarray:
    """Colours edges so that those of one colour share no vertex: the processor then works on several at once."""
    taken, colours = [0] * count, np.empty(len(edges), np.int64)
    for index, (a, b) in enumerate(edges.tolist()):
        both = taken[a] | taken[b]
        free = ~both & (both + 1)
        colours[index] = free.bit_length()
        taken[a] |= free
        taken[b] |= free
    return colours


def _weights(near: np.ndarray, distances: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns the nearest control vertices and their weights (1 - (d / d5)^2)^2; d5 is the fifth distance."""
    distances, whole = distances[:, : CONTROLS_PER_VERTEX + 1], np.isfinite(distances[:, CONTROLS_PER_VERTEX])
    last = np.where(np.isfinite(distances), distances, 0).max(axis=1)
    reach = np.where(whole, last, 1.5 * last)
    ratio = (
        np.where(np.isfinite(distances), distances, np.inf)[:, :CONTROLS_PER_VERTEX] / np.maximum(reach, 1e-9)[:, None]
    )
    weights = np.clip(1 - ratio**2, 0, 1) ** 2
    weights[:, 0] = np.maximum(weights[:, 0], 1e-6)
    return np.maximum(near[:, :CONTROLS_PER_VERTEX], 0), weights / weights.sum(axis=1, keepdims=True)


def _coarse_edges(
    faces: np.ndarray, controls: np.ndarray, near: np.ndarray, distances: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the pairs of control vertices whose cells touch, and their distances along the cloth [m]."""
    cell = near[:, 0]
    ends = np.sort(np.stack([cell[faces], cell[np.roll(faces, -1, axis=1)]], axis=2).reshape(-1, 2), axis=1)
    ends = np.unique(ends[(ends[:, 0] != ends[:, 1]) & (ends[:, 0] >= 0)], axis=0)
    at = np.where(near[controls[ends[:, 1]]] == ends[:, [0]], distances[controls[ends[:, 1]]], np.inf).min(axis=1)
    back = np.where(near[controls[ends[:, 0]]] == ends[:, [1]], distances[controls[ends[:, 0]]], np.inf).min(axis=1)
    lengths = np.minimum(at, back)
    known = np.isfinite(lengths)
    return ends[known], lengths[known]


def _triangles(vertices: np.ndarray, faces: np.ndarray, around: np.ndarray) -> np.ndarray:
    """Selects from four vertices around each sample the three with the largest triangle, oriented like the cloth."""
    normals = vertex_normals(vertices, faces)
    triples = np.stack([around[:, list(three)] for three in combinations(range(around.shape[1]), 3)], axis=1)
    corner = np.asarray(vertices, np.float64)[triples]
    across = np.cross(corner[:, :, 1] - corner[:, :, 0], corner[:, :, 2] - corner[:, :, 0])
    chosen = np.linalg.norm(across, axis=2).argmax(axis=1)
    rows = np.arange(len(around))
    triangles, across = triples[rows, chosen], across[rows, chosen]
    reversed_ = (across * normals[triangles].sum(axis=1)).sum(axis=1) < 0
    triangles[reversed_] = triangles[reversed_][:, [0, 2, 1]]
    return triangles
