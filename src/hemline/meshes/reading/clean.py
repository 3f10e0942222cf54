"""Repairs small faults of meshes from files: triangles without area, equal triangles, loose vertices, open joints."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from hemline.meshes.edges import directed_edges
from hemline.meshes.normals import face_areas

from .mesh import WELD_TOLERANCE, ReadMesh

FLATTEST = 5e-5
"""Triangles with less area than this, as a fraction of the square of their longest side, count as without any."""

SHORTEST = 1e-4
"""Corners of such a triangle nearer to each other than this fraction of its longest side become one."""

_FLAT_MOST = 0.25
"""A mesh with more triangles without area than this fraction is damaged, and left for `check_mesh` to refuse."""
_ROUNDS = 4


def clean(mesh: ReadMesh) -> ReadMesh:
    """Drops or repairs what a file may hold beside its cloth, and notes it.

    Triangles without area go: corners at one place become one, and a corner on the opposite edge splits the
    neighbour's triangle there. Of triangles at the same three places one stays. Vertices without a triangle go.

    Args:
        mesh: A mesh as read from a file.

    Returns:
        The mesh; the same one if there is nothing to do, or if a vertex of a triangle is not finite.
    """
    if not len(mesh.faces) or not np.isfinite(mesh.vertices[mesh.faces]).all():
        return mesh
    flat = _is_flat(mesh)
    if flat.mean() > _FLAT_MOST:
        return mesh
    before, count = mesh, int(flat.sum())
    for _ in range(_ROUNDS):
        if not flat.any():
            break
        mesh = _without_flat(mesh, flat)
        flat = _is_flat(mesh)
    notes = [f"{count} triangles without area were removed"] if count else []
    single = _first_of_equal(mesh)
    equal = int((~single).sum())
    if equal > 0.4 * len(mesh.faces):
        notes.append(f"{equal} triangles that lie on another one (double-sided cloth) were left out")
    elif equal:
        notes.append(f"{equal} triangles that lie on another one were left out")
    used = np.zeros(len(before.vertices), bool)
    used[before.faces] = True
    if not used.all():
        notes.append(f"{int((~used).sum())} vertices of no triangle were left out")
    if not notes:
        return before
    return mesh.with_faces(np.flatnonzero(single), *notes)


def close_joints(mesh: ReadMesh) -> ReadMesh:
    """Splits triangles at rim vertices that lie on their open edges, so that the mesh is whole there.

    Args:
        mesh: A mesh whose seams are welded.

    Returns:
        The mesh, with a note; the same one if no vertex lies on an open edge.
    """
    from scipy.spatial import KDTree

    if not len(mesh.faces) or not np.isfinite(mesh.vertices).all():
        return mesh
    directed = directed_edges(mesh.faces)
    _, index, count = np.unique(np.sort(directed, axis=1), axis=0, return_index=True, return_counts=True)
    rows = index[count == 1]
    rim = np.unique(directed[rows])
    if not len(rim):
        return mesh
    start, end = (mesh.vertices[directed[rows, k]] for k in (0, 1))
    tolerance = WELD_TOLERANCE * float(np.ptp(mesh.vertices, axis=0).max())
    reach = np.linalg.norm(end - start, axis=1)
    near = KDTree(mesh.vertices[rim]).query_ball_point(0.5 * (start + end), 0.5 * reach + tolerance)
    splits: dict[int, list[tuple[int, int, float, int]]] = {}
    for edge, found in enumerate(near):
        at = rim[found]
        at = at[(at != directed[rows[edge], 0]) & (at != directed[rows[edge], 1])]
        along = (end[edge] - start[edge]) / max(reach[edge], 1e-300)
        offset = mesh.vertices[at] - start[edge]
        part = offset @ along
        off = np.linalg.norm(offset - part[:, None] * along, axis=1)
        inner = (off < tolerance) & (part > 2 * tolerance) & (part < reach[edge] - 2 * tolerance)
        side, face = divmod(int(rows[edge]), len(mesh.faces))
        for vertex, fraction in zip(at[inner].tolist(), (part[inner] / max(reach[edge], 1e-300)).tolist(), strict=True):
            splits.setdefault(face, []).append((side, vertex, fraction, int(directed[rows[edge], 0])))
    splits = {face: each for face, each in splits.items() if len({side for side, *_ in each}) == 1}
    if not splits:
        return mesh
    return _split(mesh, splits)


def _is_flat(mesh: ReadMesh) -> np.ndarray:
    corner = mesh.vertices[mesh.faces]
    longest = np.max([((corner[:, k] - corner[:, k - 1]) ** 2).sum(axis=1) for k in range(3)], axis=0)
    return face_areas(mesh.vertices, mesh.faces) <= FLATTEST * longest


def _places(mesh: ReadMesh) -> np.ndarray:
    """Returns a number for the place of each vertex; NaN and infinity are places of their own."""
    size = float(np.ptp(mesh.vertices[mesh.faces].reshape(-1, 3), axis=0).max())
    with np.errstate(all="ignore"):
        cell = np.nan_to_num(np.round(mesh.vertices / max(WELD_TOLERANCE * size, 1e-300)), posinf=0, neginf=0)
    return np.unique(cell, axis=0, return_inverse=True)[1].reshape(-1)


def _first_of_equal(mesh: ReadMesh) -> np.ndarray:
    """Returns which triangles are the first at their three places."""
    corners = np.sort(_places(mesh)[mesh.faces], axis=1)
    _, first = np.unique(corners, axis=0, return_index=True)
    result = np.zeros(len(mesh.faces), bool)
    result[first] = True
    return result


def _without_flat(mesh: ReadMesh, flat: np.ndarray) -> ReadMesh:
    """Merges the corners of triangles without area that are at one place, and splits neighbours at the others."""
    place = _places(mesh)
    target = np.arange(len(mesh.vertices))
    for face in mesh.faces[flat]:
        corner = mesh.vertices[face]
        lengths = [float(np.linalg.norm(corner[(k + 1) % 3] - corner[k])) for k in range(3)]
        for k in range(3):
            a, b = sorted((_root(target, int(face[k])), _root(target, int(face[(k + 1) % 3]))))
            if a != b and (place[a] == place[b] or lengths[k] < SHORTEST * max(lengths)):
                target[b] = a
    target = np.array([_root(target, vertex) for vertex in range(len(target))])
    faces = target[mesh.faces]
    collapsed = (faces == np.roll(faces, 1, axis=1)).any(axis=1)
    mesh, flat = mesh.with_faces(np.flatnonzero(~collapsed), merged=target), flat[~collapsed]
    if not len(mesh.faces) or not flat.any():
        return mesh
    splits = dict(_caps(mesh, flat))
    bent = set(splits) & set(np.flatnonzero(flat).tolist())
    kept = mesh.with_faces(np.flatnonzero(~flat))
    if bent or not splits:
        return kept
    number = np.cumsum(~flat) - 1
    renumbered = np.full(len(mesh.vertices), -1)
    renumbered[mesh.faces[~flat]] = kept.faces
    moved = {
        int(number[face]): [(side, int(renumbered[v]), part, int(renumbered[s])) for side, v, part, s in each]
        for face, each in splits.items()
        if all(renumbered[v] >= 0 for _, v, _, _ in each)
    }
    return _split(kept, moved, note=False) if moved else kept


def _root(target: np.ndarray, vertex: int) -> int:
    while target[vertex] != vertex:
        vertex = int(target[vertex])
    return vertex


def _caps(mesh: ReadMesh, flat: np.ndarray) -> Iterator[tuple[int, list[tuple[int, int, float, int]]]]:
    """Yields each triangle beside one without area, with the vertex at which it is to be split."""
    directed = directed_edges(mesh.faces)
    beside: dict[tuple[int, int], list[tuple[int, int]]] = {}
    for row, (one, other) in enumerate(np.sort(directed, axis=1).tolist()):
        beside.setdefault((one, other), []).append(divmod(row, len(mesh.faces)))
    splits: dict[int, list[tuple[int, int, float, int]]] = {}
    for face in np.flatnonzero(flat).tolist():
        corner = mesh.vertices[mesh.faces[face]]
        lengths = [float(np.linalg.norm(corner[(k + 1) % 3] - corner[k])) for k in range(3)]
        side = int(np.argmax(lengths))
        a, c, m = (int(mesh.faces[face, (side + k) % 3]) for k in range(3))
        others = [each for each in beside[min(a, c), max(a, c)] if each[1] != face]
        if len(others) != 1:
            continue
        at, other = others[0]
        start = int(mesh.faces[other, at])
        along = mesh.vertices[c if start == a else a] - mesh.vertices[start]
        part = float((mesh.vertices[m] - mesh.vertices[start]) @ along / max(float(along @ along), 1e-300))
        if 0 < part < 1:
            splits.setdefault(other, []).append((at, m, part, start))
    for face, each in splits.items():
        if len({side for side, *_ in each}) == 1:
            yield face, each


def _split(mesh: ReadMesh, splits: dict[int, list[tuple[int, int, float, int]]], *, note: bool = True) -> ReadMesh:
    """Splits triangles at vertices on one of their edges: side of the triangle, vertex, fraction, start of the edge."""
    rows, faces, flat = [], [], []
    pattern = None if mesh.pattern is None else list(mesh.pattern)
    done = set(splits)
    whole = np.array([face for face in range(len(mesh.faces)) if face not in done], int)
    for face, each in splits.items():
        side = each[0][0]
        a, b, x = (int(mesh.faces[face, (side + k) % 3]) for k in range(3))
        along = sorted((part, vertex) for _, vertex, part, _ in each)
        chain = [a, *dict.fromkeys(vertex for _, vertex in along), b]
        parts = [0.0, *(min(part for part, each in along if each == vertex) for vertex in chain[1:-1]), 1.0]
        coordinates = []
        if pattern is not None and mesh.pattern_faces is not None:
            ends = [int(mesh.pattern_faces[face, (side + k) % 3]) for k in range(3)]
            coordinates = [ends[0]]
            for part in parts[1:-1]:
                pattern.append((1 - part) * mesh.pattern[ends[0]] + part * mesh.pattern[ends[1]])  # type: ignore[index]
                coordinates.append(len(pattern) - 1)
            coordinates.append(ends[1])
        for step in range(len(chain) - 1):
            rows.append(face)
            faces.append((chain[step], chain[step + 1], x))
            if coordinates:
                flat.append((coordinates[step], coordinates[step + 1], ends[2]))
    order = np.concatenate([whole, np.array(rows, int)])
    corners = np.concatenate([mesh.faces[whole], np.array(faces, int).reshape(-1, 3)])
    said = (f"{len(splits)} triangles were split at vertices that lay on their edge",) if note else ()
    result = mesh.with_faces(order, *said, faces=corners)
    if pattern is None or mesh.pattern_faces is None:
        return result
    pattern_faces = np.concatenate([mesh.pattern_faces[whole], np.array(flat, int).reshape(-1, 3)])
    return replace(result, pattern=np.array(pattern), pattern_faces=pattern_faces.astype(np.int32))
