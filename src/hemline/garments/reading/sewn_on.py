"""Turns cloth with three triangles at an edge, such as a pocket sewn on, into sheets that share single vertices."""

from collections import defaultdict
from dataclasses import replace

import numpy as np

from hemline.meshes import ReadMesh, face_areas, sheets, vertex_normals
from hemline.meshes.edges import directed_edges

SEAM_GAP = 0.002
"""Distance of the vertices of a sheet that is sewn on from the cloth beneath, between two stitches [m]."""

_SEAMS_MOST = 0.25
"""A mesh with more than two triangles at more than this fraction of its edges is no cloth with things sewn on."""


def sew_on(mesh: ReadMesh) -> ReadMesh:
    """Takes sheets apart at edges with more than two triangles, and sews them together there.

    At such an edge two triangles go on as one sheet: those of the same sheet, or else of the pair of sheets that
    continue each other most smoothly along all edges that they share. Each further sheet gets vertices of its own along
    the seam, but for every second one, which it shares with the cloth beneath, as stitches do.

    Args:
        mesh: The mesh [m].

    Returns:
        The mesh, with at most two triangles at an edge, and a note; the same one if it has no such edge.
    """
    directed = np.sort(directed_edges(mesh.faces), axis=1)
    pairs, row, times = np.unique(directed, axis=0, return_inverse=True, return_counts=True)
    row = row.reshape(-1)
    if times.max() <= 2 or (times > 2).mean() > _SEAMS_MOST:
        return mesh
    count = len(mesh.faces)
    order = np.argsort(row, kind="stable")
    ends = np.cumsum(times)
    at_edge = {int(edge): order[ends[edge] - times[edge] : ends[edge]] for edge in np.flatnonzero(times > 2)}
    links = _links(order, ends, times, count)
    sheets = _sheets(count, links)
    links += _pair_triangles(mesh, pairs, at_edge, sheets, count)
    joined = _link_sets(links)
    split, shared = _stitches(pairs[list(at_edge)])
    return _take_apart(mesh, split, joined, len(at_edge), len(shared))


def _links(order: np.ndarray, ends: np.ndarray, times: np.ndarray, count: int) -> list[tuple[int, int]]:
    """Returns pairs of triangles at edges with two of them."""
    two = np.flatnonzero(times == 2)
    return list(zip((order[ends[two] - 2] % count).tolist(), (order[ends[two] - 1] % count).tolist(), strict=True))


def _sheets(count: int, links: list[tuple[int, int]]) -> np.ndarray:
    """Returns the sheet of each triangle: triangles that are connected by edges of two."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    left, right = np.array(links, int).reshape(-1, 2).T
    graph = coo_matrix((np.ones(len(left), bool), (left, right)), (count, count))
    return connected_components(graph, directed=False)[1]


def _pair_triangles(
    mesh: ReadMesh, pairs: np.ndarray, at_edge: dict[int, np.ndarray], sheets: np.ndarray, count: int
) -> list[tuple[int, int]]:
    """Returns pairs of triangles that go on as one sheet at edges with more than two."""
    smoothness: dict[tuple[int, int], float] = defaultdict(float)
    inward: dict[int, np.ndarray] = {}
    for edge, rows in at_edge.items():
        start, end = mesh.vertices[pairs[edge]]
        along = (end - start) / max(float(np.linalg.norm(end - start)), 1e-300)
        faces = rows % count
        away = mesh.vertices[mesh.faces[faces]].mean(axis=1) - start
        away -= (away @ along)[:, None] * along
        inward[edge] = away / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-300)
        length = float(np.linalg.norm(end - start))
        for one in range(len(rows)):
            for other in range(one):
                key = tuple(sorted((int(sheets[faces[one]]), int(sheets[faces[other]]))))
                smoothness[key] -= length * float(inward[edge][one] @ inward[edge][other])  # type: ignore[index]
    result = []
    for rows in at_edge.values():
        faces, free = rows % count, set(range(len(rows)))
        while len(free) > 1:
            found = []
            for one in free:
                for other in free:
                    if other < one:
                        a, b = int(sheets[faces[one]]), int(sheets[faces[other]])
                        found.append((a == b, smoothness[min(a, b), max(a, b)], -other, -one))
            same, smooth, other, one = max(found)
            if len(free) < len(rows) and not same and smooth <= 0:
                break
            result.append((int(faces[-one]), int(faces[-other])))
            free -= {-one, -other}
    return result


def _link_sets(links: list[tuple[int, int]]) -> dict[int, set[int]]:
    joined: dict[int, set[int]] = defaultdict(set)
    for one, other in links:
        joined[one].add(other)
        joined[other].add(one)
    return joined


def _stitches(seams: np.ndarray) -> tuple[set[int], set[int]]:
    """Returns the vertices of seams at which sheets come apart, and those that they share: no two in a row."""
    beside: dict[int, list[int]] = defaultdict(list)
    for one, other in seams.tolist():
        beside[one].append(other)
        beside[other].append(one)
    shared: set[int] = set()
    seen: set[int] = set()
    for start in sorted(beside, key=lambda vertex: (len(beside[vertex]) == 2, vertex)):
        pending = [start]
        while pending:
            vertex = pending.pop()
            if vertex in seen:
                continue
            seen.add(vertex)
            if not any(other in shared for other in beside[vertex]):
                shared.add(vertex)
            pending += beside[vertex]
    return set(beside) - shared, shared


def _take_apart(
    mesh: ReadMesh, split: set[int], joined: dict[int, set[int]], edge_count: int, stitch_count: int
) -> ReadMesh:
    """Gives each sheet beyond the largest one a vertex of its own where sheets come apart."""
    around: dict[int, list[int]] = defaultdict(list)
    at_seam = np.flatnonzero(np.isin(mesh.faces, list(split)).any(axis=1))
    for face in at_seam.tolist():
        for vertex in mesh.faces[face].tolist():
            if vertex in split:
                around[vertex].append(face)
    faces, copies, owners = mesh.faces.copy(), [], []
    for vertex in sorted(split):
        for fan in _fans(around[vertex], joined)[1:]:
            copies.append(vertex)
            owners.append(fan)
            faces[fan] = np.where(faces[fan] == vertex, len(mesh.vertices) + len(copies) - 1, faces[fan])
    extended = replace(
        mesh,
        vertices=np.concatenate([mesh.vertices, mesh.vertices[copies]]),
        colours=None if mesh.colours is None else np.concatenate([mesh.colours, mesh.colours[copies]]),
        marks={name: np.concatenate([mark, mark[copies]]) for name, mark in mesh.marks.items()},
        faces=faces,
    )
    moved, turned = _lift(mesh, extended, np.array(copies, int), owners)
    extended = _turn_over(extended, turned)
    note = (
        f"seams: {edge_count} edges had three triangles or more; the sheets there, such as pockets and plackets, are "
        f"sewn together at {stitch_count} vertices"
    )
    return replace(extended, vertices=moved, notes=(*mesh.notes, note))


def _fans(faces: list[int], joined: dict[int, set[int]]) -> list[list[int]]:
    """Returns groups of triangles around a vertex that belong to one sheet, the largest group first."""
    left, fans = set(faces), []
    while left:
        pending, fan = [min(left)], []
        while pending:
            face = pending.pop()
            if face in left:
                left.remove(face)
                fan.append(face)
                pending += sorted(joined[face] & left)
        fans.append(sorted(fan))
    return sorted(fans, key=lambda fan: (-len(fan), fan))


def _turn_over(mesh: ReadMesh, turned: np.ndarray) -> ReadMesh:
    """Turns triangles over."""
    pattern_faces = None if mesh.pattern_faces is None else mesh.pattern_faces.copy()
    for corners in (faces := mesh.faces.copy(), pattern_faces):
        if corners is not None:
            corners[turned] = corners[turned][:, [0, 2, 1]]
    return replace(mesh, faces=faces, pattern_faces=pattern_faces)


def _lift(
    mesh: ReadMesh, extended: ReadMesh, copies: np.ndarray, owners: list[list[int]]
) -> tuple[np.ndarray, np.ndarray]:
    """Moves the vertices of sheets that are sewn on off the cloth beneath, to the side where each sheet lies.

    Returns also the triangles of sheets that face the same way as the cloth beneath. They are to be turned over, since
    the simulator takes connected cloth that faces the same way for neighbours that cannot meet.
    """
    vertices = extended.vertices.copy()
    if not len(copies):
        return vertices, np.empty(0, np.int64)
    base = np.ones(len(mesh.faces), bool)
    base[np.unique(np.concatenate([np.array(fan, int) for fan in owners]))] = False
    normals = vertex_normals(mesh.vertices, mesh.faces[base])[copies]
    sheet = sheets(extended.faces)[[fan[0] for fan in owners]]
    heights = np.zeros(int(sheet.max()) + 1)
    for number, (vertex, fan) in enumerate(zip(copies.tolist(), owners, strict=True)):
        away = mesh.vertices[mesh.faces[fan]].reshape(-1, 3) - mesh.vertices[vertex]
        weights = np.repeat(face_areas(mesh.vertices, mesh.faces[fan]), 3)
        heights[sheet[number]] += float((weights[:, None] * away).sum(axis=0) @ normals[number])
    side = np.where(heights[sheet] >= 0, SEAM_GAP, -SEAM_GAP)
    vertices[len(mesh.vertices) :] += side[:, None] * normals
    own_normals = vertex_normals(vertices, extended.faces)[len(mesh.vertices) :]
    agreement = np.bincount(sheet, (own_normals * normals).sum(axis=1), len(heights))
    return vertices, np.flatnonzero(np.isin(sheets(extended.faces), np.flatnonzero(agreement > 0)))
