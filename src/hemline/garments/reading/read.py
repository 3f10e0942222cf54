"""Reads a garment from a file and puts it on a body."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from hemline.errors import OffBody
from hemline.garments.dressing import body_tree
from hemline.garments.garment import Garment

from .assembly import assemble, body_made_on
from .clothes import read_clothes
from .placement import place_on_body
from .source import GarmentSource

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody


def read(
    path: str | Path, body: "ShapedBody | None" = None, unit: str | None = None, *, dressed: bool = True
) -> Garment:
    """Reads a garment: a TOML that names its mesh, a mesh alone (all else is guessed), or a hemline file.

    The garment's `notes` say what was guessed or changed.

    Args:
        path: A `.toml`, `.obj`, `.ply`, `.glb`, `.stl`, `.mhclo` or `.safetensors` file.
        body: The body to wear the garment. Unless a TOML says otherwise, the garment was made on this body, too; None:
            on the mean `anny24`. Clothes of MakeHuman (`.mhclo`) follow the body by their bindings, see
            `clothes.read_clothes`.
        unit: Unit of the mesh (m, dm, cm, mm, in, ft); None: as the TOML says, or guessed from the size.
        dressed: Whether the garment is moved onto `body`. Otherwise it stays on the shape of that body that it was
            made on: that of a hemline file, or the TOML's `betas`.

    Returns:
        The garment on `body`, or on another shape of that body.

    Raises:
        BadGarment: Unit, pins, chains or material contradict each other.
        OffBody: The garment does not sit on the body (a BadGarment as well).
        BadMesh: The mesh cannot be read, or no cloth can be made of it.
    """
    return read_source(GarmentSource.open(path, unit), body, dressed=dressed)


def read_source(source: GarmentSource, body: "ShapedBody | None" = None, *, dressed: bool = True) -> Garment:
    """Reads the garment of a file that is already open, see `read`."""
    garment = garment_of_source(source, body)
    if isinstance(garment, OffBody):
        raise garment
    return put_on(garment, body, dressed=dressed)


def garment_of_source(source: GarmentSource, body: "ShapedBody | None") -> Garment | OffBody:
    """Returns the garment of a file where the file places it.

    Args:
        source: The file.
        body: The body to wear the garment, see `read`.

    Returns:
        The garment, on the shape that it was made on; or, if it does not sit on the body, the error that says so.

    Raises:
        BadGarment: Unit, pins, chains or material contradict each other.
        OffBody: Clothes of MakeHuman are too deep inside the body.
        BadMesh: The mesh cannot be read, or no cloth can be made of it.
    """
    if source.kind == "garment":
        return Garment.load(source.path)
    if source.kind == "clothes":
        return read_clothes(source, body)
    made_on, body_notes = body_made_on(source.description, body, source.path)
    cloth, description = source.cloth, source.cloth_description
    placed = place_on_body(cloth.vertices, body_tree(made_on), cloth.name, up=description.up, origin=description.origin)
    if isinstance(placed, OffBody):
        return placed
    cloth = replace(cloth, vertices=placed.vertices, notes=body_notes + cloth.notes + placed.notes)
    return assemble(cloth, description, made_on)


def put_on(garment: Garment, body: "ShapedBody | None", *, dressed: bool) -> Garment:
    """Moves a garment onto a body if `dressed`; refuses a garment of another body in any case.

    Args:
        garment: The garment, on the shape that it was made on.
        body: The body to wear it; None leaves the garment where it is.
        dressed: Whether a garment of this body is moved onto its shape.

    Raises:
        BadGarment: The garment was made on another body.
    """
    if body is None or (not dressed and garment.body_name == body.body.name):
        return garment
    return garment.dressed(body)
