"""Makes one sheet of cloth that has thickness, or lies double: its outer side."""

import numpy as np

from hemline.arrays import Bool
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
_SHARP, _SHARP_AT_RIM = 0.3, 0.9
"""Cosines between the normals of two triangles beside each other below which a side ends between them: of wide ones,
and of those as narrow as the cloth is thick."""
_NEIGHBOURS = 24
_MAIN_PIECE = 0.1
"""Fraction of the area of a part above which a piece of it cannot be its own opposite."""
_VOTES = 0.3
"""Fraction of the area of a piece that must lie opposite to another piece."""
_LEAST_SIDE = 0.35
"""Least fraction of the area of a thick part that is one of its sides."""
_SHEET_SHARE = 0.8
"""Fraction of a thick part's area that must have an opposite side."""
_DOUBLED_SHARE = 0.9
_PARTS_COMPARED = 12

_OfFaces = Bool[np.ndarray, " faces"]


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


def _outer_side(mesh: ReadMesh, faces: np.ndarray, most: float) -> tuple[_OfFaces, float] | None:
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
    hit &= aside < 0.9 * (reach[:, None] + reach[near])
    if not hit.any():
        return None
    rows = np.arange(len(own))
    nearest = np.where(hit, aside, np.inf).argmin(axis=1)
    thickness = float(np.median(behind[rows, nearest][hit.any(axis=1)]))
    hit &= behind < 3 * thickness + 0.2 * reach[:, None]
    has, areas = hit.any(axis=1), _double_areas(corner)
    if areas[has].sum() < _SHEET_SHARE * areas.sum():
        return None
    partner = near[rows, np.where(hit, aside, np.inf).argmin(axis=1)]
    left, right = _neighbours(own)
    cosine = (normals[left] * normals[right]).sum(axis=1)
    longest = np.max([np.linalg.norm(corner[:, k] - corner[:, k - 1], axis=1) for k in range(3)], axis=0)
    narrow = areas / np.maximum(longest, 1e-300) < 1.5 * thickness
    smooth = cosine > _SHARP
    smoother = cosine > np.where(narrow[left] | narrow[right], _SHARP_AT_RIM, _SHARP)
    # sides are the pieces between sharp edges; where their rims are round, those of triangles with an opposite
    for joined in (smooth, smoother, smoother & has[left] & has[right]):
        graph = coo_matrix((np.ones(int(joined.sum()), bool), (left[joined], right[joined])), (len(own), len(own)))
        piece = connected_components(graph, directed=False)[1]
        outer = _outer_pieces(piece, partner, has, areas, (left, right))
        share = 0.0 if outer is None else areas[outer].sum() / areas.sum()
        if outer is not None and _LEAST_SIDE < share < 1 - _LEAST_SIDE:
            return outer, thickness
    return None


def _outer_pieces(
    piece: np.ndarray, partner: np.ndarray, has: np.ndarray, areas: np.ndarray, beside: tuple[np.ndarray, np.ndarray]
) -> _OfFaces | None:
    """Returns the triangles of the larger of two sides; None if a side is its own opposite."""
    from scipy.sparse import coo_matrix

    count = int(piece.max()) + 1
    votes = coo_matrix((areas[has], (piece[has], piece[partner[has]])), (count, count)).tocsr()
    votes = (votes + votes.T).tocoo()
    own_areas = np.bincount(piece, areas, count)
    links: dict[int, list[tuple[int, float]]] = {}
    for one, other, weight in zip(votes.row.tolist(), votes.col.tolist(), votes.data.tolist(), strict=True):
        if one == other and weight > own_areas[one] > _MAIN_PIECE * areas.sum():
            return None
        if one != other and weight > _VOTES * min(own_areas[one], own_areas[other]):
            links.setdefault(one, []).append((other, weight))
    side = np.zeros(count, np.int8)
    for start in np.argsort(-own_areas).tolist():
        if side[start] or start not in links:
            continue
        side[start] = 1
        pending = [start]
        while pending:
            at = pending.pop()
            for other, _ in links.get(at, []):
                if not side[other]:
                    side[other] = -side[at]
                    pending.append(other)
    sign = 1 if own_areas[side == 1].sum() >= own_areas[side == -1].sum() else -1
    # pieces without an opposite that touch the outer side alone are folds of it; strips along rims touch both sides
    left, right = piece[beside[0]], piece[beside[1]]
    for _ in range(3):
        touches = np.zeros((count, 2), bool)
        for one, other in ((left, right), (right, left)):
            touches[one[side[other] == sign], 0] = True
            touches[one[side[other] == -sign], 1] = True
        folds = (side == 0) & touches[:, 0] & ~touches[:, 1]
        side[folds] = sign
        if not folds.any():
            break
    return side[piece] == sign


def _doubles(mesh: ReadMesh, shapes: PartShapes, kept: _OfFaces) -> Bool[np.ndarray, " parts"]:
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


def _lies_on(mesh: ReadMesh, shapes: PartShapes, kept: _OfFaces, one: int, other: int) -> bool:
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
