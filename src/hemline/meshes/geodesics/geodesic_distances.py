"""Distances along a surface."""

import numpy as np

from hemline.arrays import Faces, Float, Int, Vertices
from hemline.errors import BadMesh
from hemline.meshes.edges import directed_edges

from .geodesic_kernels import sweep_fronts

_SWEEPS = 200


def geodesic_distances(
    vertices: Vertices,
    faces: Faces,
    sources: Int[np.ndarray, " sources"],
    *,
    rest_edges: Float[np.ndarray, "faces 2 2"] | None = None,
) -> Float[np.ndarray, " verts"]:
    """Returns the length of the shortest path along the surface from the nearest source to each vertex.

    It finds shortest paths along edges, then carries fronts over triangles until nothing changes: straight fronts if
    the two known corners were reached from different sources, circular ones if from the same. So neighbouring sources
    count as a line: a rim is the curve, not its vertices.

    Args:
        vertices: Positions [m].
        faces: Triangles.
        sources: Vertex ids at distance 0.
        rest_edges: The flat rest triangles; where given, paths are measured on the pattern instead of on `vertices`
            [m].

    Returns:
        Distances [m], float64; infinite where no path leads.

    Raises:
        BadMesh: There are no sources, or one does not exist.

    Source: Kimmel, Sethian, "Computing geodesic paths on manifolds", 1998 (straight fronts); Novotni, Klein,
        "Computing geodesic distances on triangular meshes", 2002 (circular fronts).
    Differs: Gauss-Seidel sweeps in the order of distance instead of a heap; the choice of front by source.
    """
    sources = np.unique(np.asarray(sources, np.int64))
    if len(sources) == 0 or sources[0] < 0 or sources[-1] >= len(vertices):
        what = f"a source of geodesic distances must be one of {len(vertices)} vertices"
        raise BadMesh(what, "none" if len(sources) == 0 else f"{sources[0]} to {sources[-1]}", "count from 0")
    lengths = opposite_lengths(vertices, faces, rest_edges)
    distance, source = _along_edges(faces, lengths, sources, len(vertices))
    face_start, face_list = faces_around(faces, len(vertices))
    order = np.argsort(distance, kind="stable")
    order = order[np.isfinite(distance[order]) & (distance[order] > 0)].astype(np.int32)
    faces = np.ascontiguousarray(faces, np.int32)
    for sweep in range(_SWEEPS):
        turned = order if sweep % 2 == 0 else np.ascontiguousarray(order[::-1])
        change = sweep_fronts(faces, lengths, turned, face_start, face_list, source, distance)
        if change < 1e-9:
            break
    return distance


def opposite_lengths(vertices: np.ndarray, faces: np.ndarray, rest_edges: np.ndarray | None) -> np.ndarray:
    """Returns the length of the edge opposite to each corner (faces, 3) [m]."""
    if rest_edges is None:
        corner = np.asarray(vertices, np.float64)[faces]
        one, two = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    else:
        one, two = rest_edges[:, :, 0], rest_edges[:, :, 1]
    return np.stack([np.linalg.norm(each, axis=1) for each in (two - one, two, one)], axis=1)


def _along_edges(faces: np.ndarray, lengths: np.ndarray, sources: np.ndarray, count: int) -> tuple[np.ndarray, ...]:
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import dijkstra

    pairs, first = np.unique(np.sort(directed_edges(faces), axis=1), axis=0, return_index=True)
    length = lengths[:, [2, 0, 1]].T.reshape(-1)[first]
    graph = csr_matrix((np.maximum(length, 1e-12), pairs.T), (count, count))
    distance, _, source = dijkstra(graph, directed=False, indices=sources, min_only=True, return_predecessors=True)
    return distance, source.astype(np.int32)


def faces_around(faces: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Returns where the faces around each vertex begin, and the faces, one vertex after the other."""
    corner = faces.reshape(-1)
    start = np.concatenate([[0], np.cumsum(np.bincount(corner, minlength=count))])
    return start.astype(np.int32), (np.argsort(corner, kind="stable") // 3).astype(np.int32)
