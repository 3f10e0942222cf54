"""Remeshes a surface with nearly equilateral triangles of one edge length."""

import numpy as np

from hemline.arrays import Bool, Faces, Points, Vertices
from hemline.errors import BadGarment
from hemline.meshes import ClosestTree, boundary_loops, edges, face_areas, vertex_normals

_ROUNDS = 40
_SAMPLES_PER_SEED = 30
"""Number of fine vertices for each seed while seeds are distributed."""
_MANY_SEEDS = 2000
"""Number of seeds above which each is chosen among fewer vertices."""
_TRIES = ((0.6, 1.0), (0.3, 1.0), (0.45, 1.03), (0.3, 1.06), (0.6, 1.1), (0.2, 1.03), (0.4, 1.15))
"""Attempts: weight of normals in distances, in edges (it keeps sheets back to back apart); factor on the seed count."""


def even_mesh(
    vertices: Vertices, faces: Faces, edge: float, middle: Bool[np.ndarray, " verts"]
) -> tuple[Vertices, Faces]:
    """Remeshes a surface: seeds are distributed evenly (Lloyd's algorithm) and joined where their cells meet.

    Args:
        vertices: The fine mesh, its edges a third of `edge` or shorter [m].
        faces: Triangles of the fine mesh.
        edge: Target edge length [m].
        middle: Mask of the vertices on the line where the mesh is mirrored: rims have corners there, with a seed each.

    Returns:
        Positions, float64 [m], and triangles.

    Raises:
        BadGarment: The edges are too long for the shape.

    Source: Valette, Chassery, "Approximated Centroidal Voronoi Diagrams for Uniform Polygonal Mesh Coarsening", 2004.
        Differs: seeds lie on the rims, too, and stay there; cells are found by distance of position and normal.
    """
    from scipy.spatial import KDTree

    loops = boundary_loops(faces)
    rims = [_seeds_along(vertices, loop, middle, edge) for loop in loops]
    rim, on_rim = np.concatenate(rims), np.concatenate(loops)
    at_rim = KDTree(rim).query(vertices[on_rim])[1]
    area = face_areas(vertices, faces)
    seed_count = (float(area.sum()) / (np.sqrt(3) / 4 * edge**2) - len(rim)) / 2
    weights = np.bincount(faces.reshape(-1), np.repeat(area, 3), len(vertices))
    normals = vertex_normals(vertices, faces)
    for turn, more in _TRIES:
        fine = np.concatenate([vertices, turn * edge * normals], axis=1)
        own = np.concatenate([rim, fine[KDTree(vertices).query(rim)[1], 3:]], axis=1)
        inner = _distribute_seeds(fine, own, max(1, round(seed_count * more)), weights)
        cell = np.array(KDTree(np.concatenate([own, inner])).query(fine)[1])
        cell[on_rim] = at_rim
        triangles = _dual(_merge_islands(cell, faces), faces)
        if _is_whole(triangles, len(rim) + len(inner), [len(each) for each in rims]):
            closest = ClosestTree(vertices, faces).closest(inner[:, :3])
            return np.concatenate([rim, closest.positions]), triangles
    cure = f"ask for edges shorter than {edge:g} m"
    raise BadGarment("a generated garment must have enough triangles for its shape", f"edges of {edge:g} m", cure)


def _seeds_along(vertices: Vertices, loop: np.ndarray, middle: np.ndarray, edge: float) -> Points:
    """Returns points along a rim, evenly spaced between its corners."""
    inside = middle[loop] & np.roll(middle[loop], -1)
    corners = np.flatnonzero(inside != np.roll(inside, 1))
    loop = np.roll(loop, -corners[0]) if len(corners) else loop
    corners = corners - corners[0] if len(corners) else np.array([0])
    points = vertices[np.append(loop, loop[0])]
    result = []
    for start, end in zip(corners, np.append(corners[1:], len(loop)), strict=True):
        part = points[start : end + 1]
        distance = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(part, axis=0), axis=1))])
        count = max(round(distance[-1] / edge), 1 if len(corners) > 1 else 3)
        at = np.linspace(0, distance[-1], count + 1)[:-1]
        result.append(np.stack([np.interp(at, distance, part[:, axis]) for axis in range(3)], axis=1))
    return np.concatenate(result)


def _distribute_seeds(fine: np.ndarray, rim: np.ndarray, count: int, weights: np.ndarray) -> np.ndarray:
    """Returns seeds off the rim: farthest vertices one after the other, each then moved to the middle of its cell."""
    from scipy.spatial import KDTree

    stride = max(1, len(fine) // (_SAMPLES_PER_SEED * (count + len(rim))))
    fine, weights = fine[::stride], weights[::stride]
    thin = fine[:: 1 + count // _MANY_SEEDS]
    away = KDTree(rim).query(thin)[0] ** 2
    square, chosen = (thin * thin).sum(axis=1), []
    for _ in range(count):
        chosen.append(int(away.argmax()))
        np.minimum(away, square - 2 * (thin @ thin[chosen[-1]]) + square[chosen[-1]], out=away)
    seeds = thin[chosen]
    for _ in range(_ROUNDS):
        cell = KDTree(np.concatenate([rim, seeds])).query(fine)[1]
        total = np.bincount(cell, weights, len(rim) + count)[len(rim) :]
        sums = [np.bincount(cell, weights * axis, len(rim) + count)[len(rim) :] for axis in fine.T]
        seeds = np.where(total[:, None] > 0, np.stack(sums, axis=1) / np.maximum(total, 1e-12)[:, None], seeds)
    return seeds


def _merge_islands(cell: np.ndarray, faces: Faces) -> np.ndarray:
    """Hands islands of cells, which are not connected to their main part, to neighbouring cells."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    start, end = edges(faces).T
    same = cell[start] == cell[end]
    graph = coo_matrix((np.ones(same.sum(), bool), (start[same], end[same])), (len(cell), len(cell)))
    part = connected_components(graph, directed=False)[1]
    size = np.bincount(part)[part]
    order = np.lexsort((part, -size, cell))
    first = np.concatenate([[True], np.diff(cell[order]) > 0])
    main = np.zeros(len(size), bool)
    main[part[order[first]]] = True
    cell = np.where(main[part], cell, -1)
    while (cell < 0).any():
        border = (cell[start] < 0) != (cell[end] < 0)
        if not border.any():
            break
        taker = np.where(cell[start[border]] < 0, start[border], end[border])
        giver = np.where(cell[start[border]] < 0, end[border], start[border])
        cell[taker] = cell[giver]
    return cell


def _dual(cell: np.ndarray, faces: Faces) -> Faces:
    """Returns a triangle for each three cells that meet in a triangle of the fine mesh."""
    corners = cell[faces]
    meet = (corners[:, 0] != corners[:, 1]) & (corners[:, 1] != corners[:, 2]) & (corners[:, 2] != corners[:, 0])
    corners = corners[meet]
    turn = corners.argmin(axis=1)
    corners = np.take_along_axis(corners, (turn[:, None] + np.arange(3)) % 3, axis=1)
    return np.unique(corners, axis=0).astype(np.int32)


def _is_whole(faces: Faces, count: int, rims: list[int]) -> bool:
    """Whether triangles form a manifold that uses each seed and has just these rims, with all their seeds on them."""
    directed = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    if len(np.unique(directed, axis=0)) != len(directed) or len(np.unique(faces)) != count:
        return False
    loops = sorted(boundary_loops(faces), key=len)
    if sorted(rims) != [len(loop) for loop in loops] or max(int(loop.max()) for loop in loops) >= sum(rims):
        return False
    holes = len(rims)
    return count - len(edges(faces)) + len(faces) == 2 - holes
