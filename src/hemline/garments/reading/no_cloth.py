"""Leaves out the parts of a garment's file that are no cloth: bodies, buttons, zips, further levels of detail."""

import re

import numpy as np

from hemline.errors import BadGarment, list_names
from hemline.meshes import ClosestTree, ReadMesh, boundary_loops

from .part_shapes import PartShapes, part_shapes
from .units import UNITS

SMALLEST_CLOTH = 0.05
"""Smallest size of a part that is cloth; smaller ones are buttons and the like [m]."""

SOLID = 0.012
"""Closed parts with more solidity than this, see `PartShapes`, are bodies, buttons or boxes, and not thick cloth."""

PERSON_HEIGHTS = (1.2, 2.3)
"""Heights of a body in a garment's file [m]."""

_TRIMS = re.compile(
    r"(button|zip|zipper|slider|puller|buckle|snap|rivet|eyelet|grommet|hanger|topstitch|stitch|stitches|stitching|avatar"
    r"|mannequin|dummy|ground|floor|camera|light|hair|eye|teeth|tongue|lash|lashes|brow|shoe|boot|tag|aglet|stopper)s?"
)
"""Words in the names of parts that are no cloth."""
_CLOTH_WORDS = re.compile(
    r"(shirt|tshirt|blouse|top|coat|dress|jacket|pants|trouser|jean|skirt|vest|hoodie|sweater|cloth|fabric)s?"
)
"""Words in the names of parts that are cloth, whatever else they are called."""
_BODY_WORDS = re.compile(r"(avatar|mannequin|dummy|body|skin|human|genesis|figure|character|head|face)s?")
"""Words in the names of bodies, whose eyes and mouths may be open."""
_DETAIL = re.compile(r"lod[\s_.-]*(\d+)", re.IGNORECASE)
_CLOSED, _NEARLY_CLOSED = 0.05, 0.6
"""Largest length of rims, over the root of the area, of closed parts, and of bodies beside cloth or called so."""
_TRIM_AREA, _PATCH_AREA, _MOST_AREA = 0.05, 0.1, 0.5
"""Largest areas of closed trims, of patches on cloth, and of all that has the name of a trim, as fractions."""
_PATCH_DISTANCE = 0.01
"""Distance from the cloth within which a patch lies on it [m]."""
_PARTS_COMPARED = 200
_BODY_SIZE = 0.6
"""A solid part of this fraction of the whole file's size may be a body."""


def leave_out_details(mesh: ReadMesh) -> ReadMesh:
    """Keeps the finest of several levels of detail (`Shirt_LOD0`, `Shirt_LOD1`), by the names of parts."""
    if mesh.face_labels is None:
        return mesh
    levels = []
    for label in mesh.labels:
        found = [match for name in label if (match := _DETAIL.search(name))]
        levels.append(int(found[0][1]) if found else -1)
    level = np.array(levels)[mesh.face_labels]
    named = np.unique(level[level >= 0])
    if len(named) < 2:
        return mesh
    kept = np.flatnonzero((level == named[0]) | (level < 0))
    note = f"levels of detail: {len(named)} by the names of the parts, of which the finest (LOD{named[0]}) was read"
    return mesh.with_faces(kept, note)


def leave_out_solids(mesh: ReadMesh, file: str) -> tuple[ReadMesh, str | None]:
    """Leaves out closed parts that are solid, in any unit: bodies and buttons.

    Args:
        mesh: The mesh, wound consistently.
        file: Name of the file in messages.

    Returns:
        The mesh, and the unit in which a body that was left out is as tall as a person; None if there was none.

    Raises:
        BadGarment: The file has nothing else.
    """
    shapes = part_shapes(mesh)
    closed = shapes.rims < _CLOSED
    large = shapes.areas > 0.3 * shapes.areas.sum()
    solid = (shapes.solidity > SOLID) & closed & (~large | (shapes.handles < 0.5))
    called = np.array([_has_word(name, _BODY_WORDS) for name in shapes.names])
    solid |= (shapes.solidity > SOLID) & (shapes.rims < _NEARLY_CLOSED) & called
    beside_cloth = ((shapes.rims > 1) & (shapes.areas > 0.1 * shapes.areas.sum())).any()
    solid |= (shapes.solidity > SOLID) & (shapes.rims < _NEARLY_CLOSED) & large & beside_cloth
    if not solid.any():
        return mesh, None
    tall = float(np.ptp(np.concatenate([shapes.low[solid], shapes.high[solid]]), axis=0).max())
    whole = float(np.ptp(np.concatenate([shapes.low, shapes.high]), axis=0).max())
    is_body = tall > _BODY_SIZE * whole and int(shapes.counts[solid].sum()) > 200
    units = [unit for unit in UNITS if PERSON_HEIGHTS[0] <= tall * UNITS[unit] < PERSON_HEIGHTS[1]]
    unit = units[0] if is_body and units else None
    height = f"{tall * UNITS[unit]:.2f} m" if unit else f"{tall:.3g} units"
    if solid.all():
        cure = "name a file with cloth: sheets or tubes with open rims"
        raise BadGarment(f"{file} has no cloth", f"{_parts(solid)}, closed and solid, {height} long", cure)
    named = _list_parts(shapes, solid)
    note = f"left out: a body of {height} ({named})" if is_body else f"left out: {named}, closed and solid"
    return mesh.with_faces(np.flatnonzero(~solid[shapes.face_parts]), note), unit


def leave_out_named(mesh: ReadMesh) -> ReadMesh:
    """Leaves out parts that are no cloth by their names, such as zips, and a flat ground plane.

    Args:
        mesh: The mesh, in any unit.
    """
    shapes = part_shapes(mesh)
    called = np.array([_is_trim(name) for name in shapes.names])
    flat = ((shapes.high - shapes.low).min(axis=1) < 1e-4 * shapes.sizes) & (shapes.counts <= 8) & ~called
    if shapes.areas[called].sum() >= _MOST_AREA * shapes.areas[~flat].sum():
        called[:] = False
    if (flat | called).all():
        return mesh
    return _leave_out(mesh, shapes, {"by their names": called, "flat, as a floor is": flat})


def leave_out_trims(mesh: ReadMesh) -> ReadMesh:
    """Leaves out parts that are no cloth by their size or place: buttons, cords, patches on the cloth.

    Args:
        mesh: The mesh [m].
    """
    shapes = part_shapes(mesh)
    small = shapes.sizes < SMALLEST_CLOTH
    if shapes.areas[small].sum() > _MOST_AREA * shapes.areas.sum():
        return mesh
    largest = shapes.areas[~small].max()
    cords = (shapes.rims < _CLOSED) & (shapes.areas < _TRIM_AREA * largest) & ~small
    patches = _patches(mesh, shapes, small | cords, largest)
    reasons = {"smaller than 5 cm": small, "closed, as cords are": cords, "lying on other cloth": patches}
    return _leave_out(mesh, shapes, reasons)


def _leave_out(mesh: ReadMesh, shapes: PartShapes, reasons: dict[str, np.ndarray]) -> ReadMesh:
    """Returns the mesh without some parts, with a note for each reason."""
    out = np.any(list(reasons.values()), axis=0)
    notes = [f"left out: {_list_parts(shapes, each)}, {why}" for why, each in reasons.items() if each.any()]
    return mesh.with_faces(np.flatnonzero(~out[shapes.face_parts]), *notes) if notes else mesh


def refuse_several(mesh: ReadMesh, file: str) -> ReadMesh:
    """Refuses a file with several garments beside each other; of copies of one garment, the first stays.

    Args:
        mesh: The mesh, in any unit.
        file: Name of the file in messages.

    Raises:
        BadGarment: There are several, of different shapes.
    """
    shapes = part_shapes(mesh)
    main = np.flatnonzero(shapes.areas > 0.1 * shapes.areas.sum())
    tubes = [part for part in main if len(boundary_loops(mesh.faces[shapes.face_parts == part])) >= 2]
    if len(tubes) < 2 or len(tubes) > 20:
        return mesh
    apart = [part for part in tubes[1:] if all(_stand_apart(shapes, part, other) for other in tubes if other != part)]
    apart = [tubes[0], *apart] if len(apart) == len(tubes) - 1 else []
    if not apart:
        return mesh
    first = tubes[0]
    if all(_are_copies(shapes, first, other) for other in apart[1:]):
        kept = np.flatnonzero(shapes.face_parts == first)
        return mesh.with_faces(kept, f"left out: {len(apart) - 1} copies of the garment, which stand beside it")
    cure = f"name one: {file}:" + (shapes.names[first].split("\n")[0] or str(int(first)))
    got = list_names([shapes.name(int(part)) for part in apart], 8)
    raise BadGarment(f"{file} holds {len(apart)} garments beside each other", got, cure)


def _stand_apart(shapes: PartShapes, one: int, other: int) -> bool:
    """Whether the boxes of two parts are apart along one axis by a quarter of their size, and overlap along others."""
    gaps = np.maximum(shapes.low[one] - shapes.high[other], shapes.low[other] - shapes.high[one])
    size = min(shapes.sizes[one], shapes.sizes[other])
    return bool(gaps.max() > 0.25 * size and (np.sort(gaps)[:2] < 0).all())


def _are_copies(shapes: PartShapes, one: int, other: int) -> bool:
    same = shapes.counts[one] == shapes.counts[other]
    return bool(same and abs(shapes.areas[one] - shapes.areas[other]) < 1e-3 * shapes.areas[one])


def _patches(mesh: ReadMesh, shapes: PartShapes, out: np.ndarray, largest: float) -> np.ndarray:
    """Returns which small parts lie on larger ones, away from their rims."""
    result = np.zeros(len(shapes.areas), bool)
    small = np.flatnonzero((shapes.areas < _PATCH_AREA * largest) & ~out)
    if not len(small) or len(small) > _PARTS_COMPARED:
        return result
    others = np.flatnonzero(~out & (shapes.areas >= _PATCH_AREA * largest))
    faces = mesh.faces[np.isin(shapes.face_parts, others)]
    tree = ClosestTree(mesh.vertices, faces)
    on_rim = np.zeros(len(mesh.vertices), bool)
    for loop in boundary_loops(faces):
        on_rim[loop] = True
    for part in small:
        closest = tree.closest(mesh.vertices[shapes.vertex_parts == part])
        beyond = np.all(on_rim[faces[closest.faces]] | (closest.weights <= 1e-9), axis=1)
        result[part] = ((closest.distances < _PATCH_DISTANCE) & ~beyond).mean() > 0.9
    return result


def _has_word(name: str, words: re.Pattern) -> bool:
    """Whether a name has one of some words: `ShirtButton_01.002` has shirt and button."""
    apart = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name)
    return any(words.fullmatch(word.lower()) for word in re.findall(r"[A-Za-z]+", apart))


def _is_trim(name: str) -> bool:
    return _has_word(name, _TRIMS) and not _has_word(name, _CLOTH_WORDS)


def _parts(which: np.ndarray) -> str:
    count = int(which.sum())
    return "a part" if count == 1 else f"{count} parts"


def _list_parts(shapes: PartShapes, which: np.ndarray) -> str:
    """Returns how many parts these are, with the names of some."""
    names = list(dict.fromkeys(shapes.name(int(part)) for part in np.flatnonzero(which) if shapes.names[part]))
    shown = ", ".join(names[:4]) + (", and more" if len(names) > 4 else "")
    return _parts(which) + (f" {shown}" if shown else "")
