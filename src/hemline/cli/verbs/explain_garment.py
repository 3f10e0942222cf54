"""The part of `hemline explain` for garments: five lines, and a picture of the mesh beside the body at rest."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hemline.errors import OffBody, list_names

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody
    from hemline.garments import Garment
    from hemline.garments.reading.source import GarmentSource

_SIZE = (340, 460)
_LEFT_OUT = "truth"
"""Colour of what was left out of the cloth."""
_GAP = 0.15
"""Distance between a garment that is not on the body and the body beside it [m]."""
_FULL_LIST = 6
_PART, _PLACE, _PINS, _CLOTH = "parts", "place", "pins", "cloth"
_LINES = {
    **dict.fromkeys(("left out", "levels of detail", "thickness", "layers", "seams"), _PART),
    **dict.fromkeys(("up", "origin", "winding", "body", "bindings"), _PLACE),
    **dict.fromkeys(("pins", "key joint"), _PINS),
    **dict.fromkeys(("material", "rest shape"), _CLOTH),
}
"""Line that a note belongs to, by its first words; others tell of the mesh, and so of its parts."""


def explain_garment(file: str, picture: Path) -> Iterator[str]:
    """Reads a garment, yields five lines on what was understood of it, and draws it. Nothing is simulated.

    Args:
        file: A mesh, `FILE:PART`, a TOML, a `.mhclo`, a garment file of hemline, or the name of a garment.
        picture: The picture to write.

    Raises:
        BadGarment, BadMesh: The file cannot be read, or no cloth can be made of it.
        BadOutput: The picture cannot be written.
    """
    from hemline import bodies, garments
    from hemline.garments.reading.source import GarmentSource
    from hemline.garments.shipped import is_name

    source = None if is_name(file) else GarmentSource.open(file)
    if source is not None and source.kind == "mesh":
        yield from _explain_mesh(source, picture)
        return
    garment = garments.load(file) if source is None else garments.read(file, dressed=False)
    shaped = bodies.load(garment.body_name).shaped(garment.body_betas)
    yield _garment_line(
        garment.name,
        garment.vertices,
        garment.faces,
        "metres, as hemline's own"
        if source is None or source.kind == "garment"
        else "metres, by its bindings to the body",
    )
    yield from _lines_on_body(garment, shaped, tried_on=False)
    _draw(picture, garment.vertices, [(garment.vertices, garment.faces, "cloth")], shaped, on_body=True)


def _explain_mesh(source: "GarmentSource", picture: Path) -> Iterator[str]:
    from hemline.garments.reading.assembly import body_made_on
    from hemline.garments.reading.read import garment_of_source
    from hemline.garments.reading.units import Z_UP_NOTE, to_y_up

    cloth = source.cloth
    yield _garment_line(cloth.name, cloth.vertices, cloth.faces, _unit(source))
    shaped, _ = body_made_on(source.description, None, source.path)
    garment = garment_of_source(source, shaped)
    if isinstance(garment, OffBody):
        up = source.description.up or _likely_up(source, shaped)
        yield f"parts: {_of_line(cloth.notes, _PART) or 'one mesh, of which nothing was left out'}"
        winding = _of_line([note for note in cloth.notes if note.startswith("winding")], _PLACE)
        yield (
            f"place: not on the body ({garment.got}), so 'hemline tryon' will find its place and size; {up} is up"
            f"{'' if source.description.up else ', as it fits the body best so'}{winding and '; '}{winding}"
        )
        openings = ", ".join(f"{rim.length:.2f} m" for rim in _rims(cloth.vertices, cloth.faces)[:_FULL_LIST])
        yield f"openings: {openings or 'none'} long; pins: chosen once it is on the body"
        rest = _of_line(cloth.notes, _CLOTH)
        yield f"cloth: {source.description.material or 'cotton, as no material was named'}{rest and '; '}{rest}"
    else:
        up = "z" if Z_UP_NOTE in garment.notes else source.description.up or "y"
        yield from _lines_on_body(garment, shaped, tried_on=True, up=up)
    points = to_y_up(cloth.vertices, up)
    on_body = not isinstance(garment, OffBody)
    if on_body:  # the origin of the file may be on the floor
        points = points + (0, float(np.median(garment.vertices[:, 1])) - float(np.median(points[:, 1])), 0)
    meshes = [(points, cloth.faces, "cloth"), *_rest_of_file(source, points, up)]
    _draw(picture, points, meshes, shaped, on_body=on_body)


def _garment_line(name: str, vertices: np.ndarray, faces: np.ndarray, unit: str) -> str:
    size = " x ".join(f"{side:.2f}" for side in np.ptp(vertices, axis=0))
    return f"garment: '{name}', {len(vertices)} vertices, {len(faces)} triangles, {size} m; {unit}"


def _unit(source: "GarmentSource") -> str:
    """Describes the unit of a mesh, and the other units in which it would have a likely size."""
    from hemline.garments.reading.units import UNIT_NAMES, UNITS, other_units

    full = UNIT_NAMES.get(source.unit, source.unit)
    if source.description.unit is not None:
        return f"in {full}, as declared"
    size = float(np.ptp(source.cloth.vertices, axis=0).max())
    others = [
        f"{size / UNITS[source.unit] * UNITS[unit]:.2f} m in {UNIT_NAMES.get(unit, unit)}"
        for unit in other_units(size, source.unit)
    ]
    return f"in {full}, by its size" + (f" (it would be {' or '.join(others)})" if others else "")


def _likely_up(source: "GarmentSource", shaped: "ShapedBody") -> str:
    """Returns the axis with which a mesh fits the body best among a few places and poses."""
    from hemline.garments.reading.units import AXES, UP_GUESS_RATIO
    from hemline.tryon.alignment import misfit

    cloth = source.cloth
    with_y, with_z = (misfit(cloth.vertices, cloth.faces, shaped, axis, sizes=(0.0,)) for axis in AXES)
    return AXES[with_z < UP_GUESS_RATIO * with_y]


def _lines_on_body(garment: "Garment", shaped: "ShapedBody", *, tried_on: bool, up: str = "y") -> Iterator[str]:
    """Yields the lines on parts, place, openings and cloth of a garment that lies on a body.

    Args:
        garment: The garment.
        shaped: The body that it lies on.
        tried_on: Whether it would be tried on if it does not sit on the body.
        up: The axis that is up in its file.
    """
    from hemline.garments.dressing import body_tree
    from hemline.garments.reading.units import Z_UP_NOTE
    from hemline.tryon.open_garment import misfit_reason

    pieces = [f"'{piece.name}'" for piece in garment.pieces]
    parts = [f"{len(pieces)} pieces, {', '.join(pieces)}"] if pieces else []
    parts += [text] if (text := _of_line(garment.notes, _PART)) else []
    yield f"parts: {'; '.join(parts) or 'one mesh, of which nothing was left out'}"
    some = garment.vertices[:: max(1, len(garment.vertices) // 1000)]
    low, middle, high = 1000 * np.percentile(body_tree(shaped).signed_distances(some), (0, 50, 100))
    place = (
        f"place: {up} is up; on {garment.body_name}, {low:.0f} to {high:.0f} mm from the skin, half within {middle:.0f}"
    )
    if tried_on and Z_UP_NOTE in garment.notes:
        place += "; as that was guessed, it will be tried on"
    elif tried_on and (reason := misfit_reason(garment, shaped)):
        place += f"; {reason}, so it will be tried on"
    elif not any(note.startswith("winding") for note in garment.notes):
        place += "; worn as it lies, its triangles face away from the body"
    others = _of_line([note for note in garment.notes if note != Z_UP_NOTE], _PLACE)
    yield place + (f"; {others}" if others else "")
    pins = _of_line(garment.notes, _PINS, cut="pins: ") or f"carried by the {garment.key_joint}"
    count = f"{len(garment.pins)}, " if len(garment.pins) else ""
    yield f"openings: {_openings(garment, shaped)}; pins: {count}{pins}"
    materials = ", ".join(dict.fromkeys(piece.material.name for piece in garment.layers))
    rest = _of_line([note for note in garment.notes if not note.startswith("material: ")], _CLOTH)
    guessed = ", as no material was named" if any(note.startswith("material: ") for note in garment.notes) else ""
    yield f"cloth: {materials}{guessed}{rest and '; '}{rest}"


def _of_line(notes, line: str, cut: str = "") -> str:
    """Returns the notes that belong to a line, joined.

    Args:
        notes: Notes of a garment.
        line: A value of `_LINES`.
        cut: Beginning that the line has already.
    """
    chosen = []
    for note in notes:
        if note.startswith("unit: "):
            continue
        belongs = next((each for words, each in _LINES.items() if note.startswith(f"{words}: ")), None)
        if belongs is None:
            belongs = _PLACE if "inside the body" in note else _PART
        if belongs == line:
            chosen.append(note.removeprefix(cut))
    return "; ".join(chosen)


def _rims(vertices: np.ndarray, faces: np.ndarray) -> list:
    from hemline.tryon.rims import rims_of

    return rims_of(np.asarray(vertices, np.float64), faces)


def _openings(garment: "Garment", shaped: "ShapedBody") -> str:
    """Describes each opening by the joint nearest to it, and says which of them no limb goes through."""
    from hemline.motions import JOINT_NAMES
    from hemline.tryon.skeleton import Skeleton

    placed, skeleton, named = garment.vertices.astype(np.float64), Skeleton.of(shaped.joints), []
    for rim in (each.at(placed) for each in _rims(placed, garment.faces)):
        near = JOINT_NAMES[int(np.linalg.norm(shaped.joints - rim.points[-1], axis=1).argmin())]
        named.append(f"{near} {rim.length:.2f} m" + ("" if rim.has_limb(skeleton) else " (no limb through it)"))
    return f"{len(named)} ({list_names(named, _FULL_LIST)})" if named else "none"


def _rest_of_file(source: "GarmentSource", cloth: np.ndarray, up: str) -> list:
    """Returns the triangles of the file none of whose corners is a vertex of the cloth, where they lie beside it."""
    from scipy.spatial import KDTree

    from hemline.garments.reading.units import UNITS, to_y_up

    raw = to_y_up(source.mesh.vertices * UNITS[source.unit], up)
    as_read = to_y_up(source.cloth.vertices, up)
    apart = KDTree(as_read).query(raw)[0] > 1e-6 * float(np.ptp(as_read))
    faces = source.mesh.faces[apart[source.mesh.faces].all(axis=1)]
    used, faces = np.unique(faces, return_inverse=True)
    moved = raw[used] + (cloth - as_read)[0]
    return [(moved, faces.reshape(-1, 3).astype(np.int32), _LEFT_OUT)] if len(used) else []


def _draw(path: Path, cloth: np.ndarray, meshes: list, shaped: "ShapedBody", *, on_body: bool) -> None:
    """Draws the mesh as it was read from two sides, and to scale with the body at rest: on it, or beside it."""
    from hemline.pictures import picture_of, side_by_side, write_png

    shift = np.zeros(3)
    if not on_body:
        left = min(float(mesh[0][:, 0].min()) for mesh in meshes)
        body = shaped.vertices
        shift = np.array(
            [
                float(body[:, 0].max()) + _GAP - left,
                float(body[:, 1].mean() - cloth[:, 1].mean()),
                -float(cloth[:, 2].mean()),
            ]
        )
    placed = [(vertices + shift, faces, colour) for vertices, faces, colour in meshes]
    body_mesh = (shaped.vertices, shaped.body.faces, "body")
    pictures = [picture_of(meshes, view, size=_SIZE) for view in ("front", "side")]
    pictures.append(picture_of([body_mesh, *placed], "three_quarter" if on_body else "front", size=_SIZE))
    captions = ["as read, front", "as read, side", "on the body at rest" if on_body else "beside the body at rest"]
    write_png(path, side_by_side(pictures, captions))
