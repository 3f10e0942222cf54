"""Makes one sheet of cloth that has thickness, or lies double: its outer side."""

import numpy as np

from hemline.arrays import Mask
from hemline.meshes import ClosestTree, ReadMesh, face_normals

from .part_shapes import PartShapes, part_shapes

THICKEST = 0.03
"""Largest distance of the two sides of cloth with thickness, for garments that are rings or have several holes [m]."""

THICK_SHEET = 0.012
"""Largest distance of the two sides of a closed sheet without holes, such as a cape [m]."""

DOUBLE = 0.008
"""Largest distance of a sheet from another one that it doubles [m]."""

_CLOSED = 0.1
"""Largest length of the rims of a closed part, over the root of its area."""
_OPPOSITE = -0.4
"""Largest cosine between the normals of the two sides."""
_NEIGHBOURS = 24
_SHEET_SHARE = 0.8
"""Fraction of a thick part's area that must have an opposite side."""
_DOUBLED_SHARE = 0.9
_PARTS_COMPARED = 12


def single_layer(mesh: ReadMesh) -> ReadMesh:
    """Returns the outer side of parts that have thickness, and the outer one of sheets that lie on each other.

    Args:
        mesh: The mesh, wound consistently [m].

    Returns:
        The mesh, with notes; the same one if it has neither.
    """
    shapes = part_shapes(mesh)
    kept, notes = np.ones(len(mesh.faces), bool), []
    for part in np.flatnonzero((shapes.rims < _CLOSED) & (shapes.areas > 0.02 * shapes.areas.sum())):
        faces = np.flatnonzero(shapes.face_parts == part)
        found = _outer_side(mesh, faces, THICKEST if shapes.handles[part] > 0.5 else THICK_SHEET)
        if found is None:
            continue
        outer, thickness = found
        kept[faces[~outer]] = False
        notes.append(
            f"thickness: {shapes.name(int(part))} is a closed shell about {1000 * thickness:.1f} mm thick; "
            f"its outer side is the cloth, {int((~outer).sum())} triangles of the inner side were left out"
        )
    doubled = _doubles(mesh, shapes, kept)
    if doubled.any():
        inner = doubled[shapes.face_parts] & kept
        kept &= ~inner
        names = ", ".join(shapes.name(int(part)) for part in np.flatnonzero(doubled))
        notes.append(f"layers: {names} lies within {1000 * DOUBLE:.0f} mm of other cloth all over, and was left out")
    return mesh.with_faces(np.flatnonzero(kept), *notes) if notes else mesh


def _outer_side(mesh: ReadMesh, faces: np.ndarray, most: float) -> tuple[Mask, float] | None:
    """Returns which triangles are on the outer side of a thick part, and its thickness; None if it is not thick."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import KDTree

    own = mesh.faces[faces]
    corner = mesh.vertices[own]
    centres, normals = corner.mean(axis=1), face_normals(mesh.vertices, own)
    if (centres * normals * _double_areas(corner)[:, None]).sum() < 0:
        normals = -normals
    reach = np.linalg.norm(corner - centres[:, None], axis=2).max(axis=1)
    count = min(_NEIGHBOURS * 4, len(own))
    distance, near = KDTree(centres).query(centres, count, distance_upper_bound=most + 2.5 * float(np.median(reach)))
    near = np.where(np.isfinite(distance), near, 0)
    behind = ((centres[:, None] - centres[near]) * normals[:, None]).sum(axis=2)
    aside = np.sqrt(np.maximum(np.where(np.isfinite(distance), distance, np.inf) ** 2 - behind**2, 0))
    opposite = (normals[:, None] * normals[near]).sum(axis=2) < _OPPOSITE
    hit = opposite & np.isfinite(distance) & (behind > 1e-6) & (behind < most)
    hit &= aside < 1.2 * (reach[:, None] + reach[near]) * 0.75
    has = hit.any(axis=1)
    areas = _double_areas(corner)
    if areas[has].sum() < _SHEET_SHARE * areas.sum():
        return None
    nearest = np.where(hit, aside, np.inf).argmin(axis=1)
    partner, depth = (each[np.arange(len(own)), nearest] for each in (near, behind))
    thickness = float(np.median(depth[has]))
    # sides are the pieces that remain when triangles without an opposite are taken away
    left, right = _neighbours(own)
    joined = has[left] & has[right]
    graph = coo_matrix((np.ones(int(joined.sum()), bool), (left[joined], right[joined])), (len(own), len(own)))
    piece = connected_components(graph, directed=False)[1]
    outer = _outer_pieces(piece, partner, has, areas)
    if outer is None:
        return None
    chosen = outer & has
    # strips at the rim belong to neither side; what is cut off by them but belongs to the outer one is little
    share = areas[chosen].sum() / areas.sum()
    return (chosen, thickness) if 0.35 < share < 0.65 else None


def _outer_pieces(piece: np.ndarray, partner: np.ndarray, has: np.ndarray, areas: np.ndarray) -> Mask | None:
    """Returns the triangles of the larger of two sides; None if one side is its own opposite."""
    from scipy.sparse import coo_matrix

    count = int(piece.max()) + 1
    votes = coo_matrix((areas[has], (piece[has], piece[partner[has]])), (count, count)).tocsr()
    votes = (votes + votes.T).tocoo()
    own_areas = np.bincount(piece[has], areas[has], count)
    side = np.zeros(count, np.int8)
    order = np.argsort(-own_areas)
    links: dict[int, list[tuple[int, float]]] = {}
    for one, other, weight in zip(votes.row.tolist(), votes.col.tolist(), votes.data.tolist(), strict=True):
        if weight > 0.1 * min(own_areas[one], own_areas[other]) or one == other:
            links.setdefault(one, []).append((other, weight))
    if any(weight > own_areas[one] for one, each in links.items() for other, weight in each if one == other):
        return None
    for start in order.tolist():
        if side[start] or own_areas[start] == 0:
            continue
        side[start] = 1
        pending = [start]
        while pending:
            at = pending.pop()
            for other, _ in links.get(at, []):
                if other != at and not side[other]:
                    side[other] = -side[at]
                    pending.append(other)
    by_side = [own_areas[side == sign].sum() for sign in (1, -1)]
    outer = 1 if by_side[0] >= by_side[1] else -1
    return side[piece] == outer


def _doubles(mesh: ReadMesh, shapes: PartShapes, kept: Mask) -> Mask:
    """Returns which parts lie on a part as large, all over."""
    result = np.zeros(len(shapes.areas), bool)
    areas = np.bincount(shapes.face_parts[kept], minlength=len(shapes.areas)) * 0.0
    own = mesh.faces[kept]
    corner = mesh.vertices[own]
    areas += np.bincount(shapes.face_parts[kept], _double_areas(corner), len(shapes.areas))
    main = [int(part) for part in np.argsort(-areas)[:_PARTS_COMPARED] if areas[part] > 0.05 * areas.sum()]
    for place, outer in enumerate(main):
        if result[outer]:
            continue
        for inner in main[place + 1 :]:
            boxes = (
                np.abs(shapes.low[outer] - shapes.low[inner]).max(),
                np.abs(shapes.high[outer] - shapes.high[inner]).max(),
            )
            if result[inner] or areas[inner] < 0.7 * areas[outer] or max(boxes) > 4 * DOUBLE:
                continue
            result[inner] = _lies_on(mesh, shapes, kept, inner, outer) and _lies_on(mesh, shapes, kept, outer, inner)
    return result


def _lies_on(mesh: ReadMesh, shapes: PartShapes, kept: Mask, one: int, other: int) -> bool:
    mine, theirs = (mesh.faces[kept & (shapes.face_parts == part)] for part in (one, other))
    points = mesh.vertices[np.unique(mine)]
    return bool((ClosestTree(mesh.vertices, theirs).closest(points).distances < DOUBLE).mean() > _DOUBLED_SHARE)


def _double_areas(corner: np.ndarray) -> np.ndarray:
    return np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)


def _neighbours(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns pairs of triangles with a common edge."""
    from hemline.meshes.edges import directed_edges

    low, high = np.sort(directed_edges(faces), axis=1).T
    order = np.lexsort((high, low))
    same = (low[order][1:] == low[order][:-1]) & (high[order][1:] == high[order][:-1])
    return order[:-1][same] % len(faces), order[1:][same] % len(faces)
