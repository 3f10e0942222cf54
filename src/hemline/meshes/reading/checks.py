"""Checks whether cloth can be made of a triangle mesh."""

import numpy as np

from hemline.arrays import Faces, Vertices
from hemline.errors import BadMesh
from hemline.meshes.components import components
from hemline.meshes.edges import directed_edges
from hemline.meshes.normals import face_areas


def check_mesh(vertices: Vertices, faces: Faces, *, name: str = "the mesh") -> tuple[str, ...]:
    """Raises if no cloth can be made of a mesh, and returns notes on what is unusual.

    It raises for NaN, no faces, a face that points past the last vertex, degenerate triangles, edges with more than two
    triangles. It notes unreferenced vertices, several vertices at one place, triangles wound against their neighbours,
    several parts.

    Args:
        vertices: Positions.
        faces: Triangles.
        name: Name of the mesh in errors.

    Returns:
        One note for each unusual property.

    Raises:
        BadMesh: No cloth can be made of the mesh.
    """
    _refuse_bad_numbers(vertices, faces, name)
    _refuse_degenerate(vertices, faces, name)
    _refuse_fans(faces, name)
    notes = []
    used = np.bincount(faces.reshape(-1), minlength=len(vertices)) > 0
    if not used.all():
        notes.append(f"{(~used).sum()} vertices belong to no triangle, the first is {int(np.argmin(used))}")
    doubled = used.sum() - len(np.unique(vertices[used], axis=0))
    if doubled:
        notes.append(f"{doubled} vertices lie exactly on another one: the mesh is open there")
    flipped = consistent_winding(faces)[1]
    if flipped:
        notes.append(f"{flipped} triangles are wound against their neighbours")
    parts = len(np.unique(components(faces, len(vertices))[used]))
    if parts > 1:
        notes.append(f"{parts} parts that are not connected")
    return tuple(notes)


def consistent_winding(faces: Faces) -> tuple[Faces, int]:
    """Flips triangles so that neighbours agree; in each part the majority keeps its orientation.

    Args:
        faces: Triangles; at most two at an edge. A Möbius strip cannot agree everywhere.

    Returns:
        The triangles, and how many were flipped.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import breadth_first_order, connected_components

    left, right, differs = _neighbours(faces)
    # weights 1: same winding, 2: opposite
    graph = coo_matrix((1 + differs, (left, right)), (len(faces), len(faces))).tocsr()
    if not differs.any():
        return faces, 0
    graph = graph + graph.T
    part = connected_components(graph, directed=False)[1]
    is_flipped = np.zeros(len(faces), bool)
    for start in np.unique(part, return_index=True)[1]:
        order, before = breadth_first_order(graph, start, directed=False)
        for face in order[1:]:
            is_flipped[face] = is_flipped[before[face]] ^ (graph[before[face], face] == 2)
        members = order
        if 2 * is_flipped[members].sum() > len(members):
            is_flipped[members] = ~is_flipped[members]
    result = faces.copy()
    result[is_flipped] = result[is_flipped][:, [0, 2, 1]]
    return result, int(is_flipped.sum())


def _neighbours(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns pairs of triangles with a common edge, and whether they are wound against each other."""
    directed = directed_edges(faces)
    low, high = np.sort(directed, axis=1).T
    order = np.lexsort((high, low))
    same = (low[order][1:] == low[order][:-1]) & (high[order][1:] == high[order][:-1])
    one, two = order[:-1][same], order[1:][same]
    return one % len(faces), two % len(faces), (directed[one, 0] == directed[two, 0]).astype(np.int8)


def _refuse_bad_numbers(vertices: np.ndarray, faces: np.ndarray, name: str) -> None:
    finite = np.isfinite(vertices).all(axis=1)
    if not finite.all():
        got = f"NaN or infinity in {(~finite).sum()} of {len(vertices)}, first in vertex {int(np.argmin(finite))}"
        raise BadMesh(f"{name} must have finite vertices", got, "export the mesh again")
    if len(faces) == 0:
        raise BadMesh(f"{name} must have faces", "none", "export the mesh again with faces")
    if faces.min() < 0 or faces.max() >= len(vertices):
        face = int(np.argmax(((faces < 0) | (faces >= len(vertices))).any(axis=1)))
        got = f"{faces[face].tolist()} with {len(vertices)} vertices"
        raise BadMesh(f"{name}: face {face} names a vertex that does not exist", got, "count from 0, or export again")


def _refuse_degenerate(vertices: np.ndarray, faces: np.ndarray, name: str) -> None:
    corner = vertices[faces].astype(np.float64)
    longest = np.max([np.linalg.norm(corner[:, i] - corner[:, i - 1], axis=1) for i in range(3)], axis=0)
    # height over the longest edge below a millionth of it: no direction can be computed from such a triangle
    bad = face_areas(vertices.astype(np.float64), faces) <= 0.5e-6 * longest**2
    if bad.any():
        got = f"{bad.sum()} of {len(faces)}, the first is face {int(np.argmax(bad))}"
        raise BadMesh(
            f"{name} must have triangles with an area", got, "remove degenerate triangles or merge their vertices"
        )


def _refuse_fans(faces: np.ndarray, name: str) -> None:
    pairs, count = np.unique(np.sort(directed_edges(faces), axis=1), axis=0, return_counts=True)
    if (count > 2).any():
        edge = pairs[int(np.argmax(count > 2))].tolist()
        got = f"{(count > 2).sum()} edges with more, the first between vertices {edge[0]} and {edge[1]}"
        raise BadMesh(
            f"{name} must have at most two triangles at an edge", got, "split the mesh there or remove inner layers"
        )
