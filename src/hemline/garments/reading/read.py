"""A garment from a mesh file, with or without the TOML beside it."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from hemline.garments.dressing import body_tree
from hemline.garments.garment import Garment
from hemline.meshes import read_mesh, welded

from .assembly import Cloth, assembled, body_made_on, checked_mesh, wound_alike
from .clothes import read_clothes
from .garment_toml import GarmentFile, read_garment_toml
from .placement import on_body
from .rest_shape import rest_shape
from .units import UNITS, unit_of

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody


def read(
    path: str | Path, body: "ShapedBody | None" = None, unit: str | None = None, *, dressed: bool = True
) -> Garment:
    """Read a garment: a TOML that names its mesh, a mesh alone (all else is guessed), or a hemline file.

    What was guessed or changed is in the garment's `notes`.

    Args:
        path: A `.toml`, `.obj`, `.ply`, `.glb`, `.stl`, `.mhclo` or `.safetensors` file.
        body: The body to wear it. Without a TOML that says otherwise, also the one it was made on; None: the mean
            `anny24`. Clothes of MakeHuman (`.mhclo`) follow it by their bindings, see `clothes.read_clothes`.
        unit: Unit of the mesh (m, dm, cm, mm, in, ft); None: as the TOML says, or guessed from the size.
        dressed: Whether it is moved onto `body`. Otherwise it stays on the shape of it that it was made on: that of a
            hemline file, the TOML's `betas`.

    Returns:
        The garment on `body`, or on another shape of it.

    Raises:
        BadGarment: Unit, pins, chains or material contradict each other.
        OffBody: It does not sit on the body (a BadGarment as well).
        BadMesh: The mesh cannot be read, or no cloth can be made of it.
    """
    path = Path(path)
    if path.suffix == ".safetensors":
        return _worn(Garment.load(path), body, dressed)
    said = read_garment_toml(path) if path.suffix == ".toml" else GarmentFile(mesh=path.name)
    if Path(said.mesh).suffix.lower() == ".mhclo":
        return read_clothes(path, replace(said, unit=unit or said.unit), body)
    made_on, notes = body_made_on(said, body, path)
    cloth = _placed(path, said, made_on, unit or said.unit)
    return _worn(assembled(replace(cloth, notes=notes + cloth.notes), said, made_on), body, dressed)


def _worn(garment: Garment, body: "ShapedBody | None", dressed: bool) -> Garment:
    if body is None or (not dressed and garment.body_name == body.body.name):
        return garment
    return garment.dressed(body)


def _placed(path: Path, said: GarmentFile, body: "ShapedBody", unit: str | None) -> Cloth:
    """The mesh of a garment on the body it was made on."""
    cloth = cloth_of(path, said, unit)
    vertices, placed = on_body(cloth.vertices, body_tree(body), cloth.name, up=said.up, origin=said.origin)
    return replace(cloth, vertices=vertices, notes=cloth.notes + placed)


def cloth_of(path: Path, said: GarmentFile, unit: str | None) -> Cloth:
    """The mesh of a garment as it is in its file, in metres, whatever its place and its axis up.

    Args:
        path: The mesh, or the TOML that names it.
        said: What the TOML says.
        unit: Unit of the mesh; None: guessed.

    Raises:
        BadGarment: The unit contradicts the size, or the pattern is asked for and there is none.
        BadMesh: The mesh cannot be read, or no cloth can be made of it.
    """
    name = said.name or path.stem
    mesh = read_mesh(path.parent / said.mesh)
    if not said.names_vertices:
        mesh = welded(mesh)
    notes = mesh.notes + checked_mesh(mesh.vertices, mesh.faces, name)
    found_unit, unit_notes = unit_of(mesh.vertices, unit, name)
    scale = UNITS[found_unit]
    vertices = mesh.vertices * scale
    rest_edges, from_pattern, metric_notes = rest_shape(mesh, vertices, scale, said.pattern, name)
    return wound_alike(Cloth(name, vertices, mesh.faces, rest_edges, from_pattern, notes + unit_notes + metric_notes))
