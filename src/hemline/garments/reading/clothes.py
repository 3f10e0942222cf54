"""Clothes of MakeHuman on the shipped body of any shape."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Faces, Int, Vertices
from hemline.errors import BadGarment
from hemline.garments.clearance import push_out_of_body
from hemline.garments.dressing import CLEARANCE, body_tree
from hemline.garments.garment import Garment
from hemline.garments.pin_rules import PinGroup
from hemline.garments.rest_metric import rest_edges_of_mesh
from hemline.garments.worn_together import worn_together
from hemline.meshes import ClosestTree, components, read_obj

from .assembly import Cloth, assembled, body_made_on, checked_mesh, wound_alike
from .garment_toml import GarmentFile
from .mhclo import BASE_MESH, read_mhclo

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

SMALLEST = 0.05
"""Size from which on a component is cloth; smaller ones are buttons and the like [m]."""

_NEAR = 0.03
_COMPONENTS_MAX, _PIECES_MAX = 2_000, 30
"""Components of clothes, buttons among them, and pieces of cloth; each piece is compared with each other one."""


def read_clothes(path: Path, said: GarmentFile, body: "ShapedBody | None") -> Garment:
    """Read clothes of MakeHuman; vertices follow the body's shape by their bindings, the cut is that of the mean shape.

    Components that are not connected become pieces, from the skin outwards, each with pins of its own; buttons and
    the like are left out.

    Args:
        path: The `.mhclo`, or the TOML that names one.
        said: What the TOML says; `betas` are the shape that the clothes are cut for. Vertex ids are those of the OBJ.
        body: The body to wear them; None: that shape.

    Raises:
        BadBody: Another body than the one that was made from MakeHuman's mesh.
        BadGarment: As `read_mhclo`; a TOML that says where the mesh is; bindings that do not fit the mesh; or clothes
            that are too deep inside the body.
        BadMesh: The OBJ cannot be read, or no cloth can be made of it.
    """
    from hemline.bodies.base_mesh import base_mesh

    _refuse_places(path, said)
    base = base_mesh(BASE_MESH)
    bound = read_mhclo(path.parent / said.mesh, len(base))
    mesh = read_obj(bound.mesh)
    if len(mesh.vertices) != len(bound.corners):
        what = f"{path} must bind each vertex of {bound.mesh.name}"
        raise BadGarment(what, f"{len(bound.corners)} bindings, {len(mesh.vertices)} vertices", "export both again")
    made_on, notes = body_made_on(said, body, path)
    cut_for = made_on.body.shaped(said.betas or ())
    cut, worn = (bound.on(base.on(each)) for each in (cut_for, body or cut_for))
    name = said.name or bound.name
    notes += (*bound.notes, *mesh.notes, *checked_mesh(cut, mesh.faces, name), _cut_note(said))
    notes += ("bindings: body vertices that the file hides are kept",)
    whole = wound_alike(Cloth(name, worn, mesh.faces, rest_edges_of_mesh(cut, mesh.faces), False, notes))
    parts, left_out = _parts(whole, cut, cut_for)
    pieces = [_piece(whole, ids, number, len(parts), said, body or cut_for) for number, ids in enumerate(parts, 1)]
    garment = pieces[0] if len(pieces) == 1 else worn_together(pieces, name=name)
    return _cleared(replace(garment, notes=(*whole.notes, *left_out, *garment.notes)), body or cut_for)


def _cleared(garment: Garment, body: "ShapedBody") -> Garment:
    """The garment out of the body once more, as layers and raised triangles come near to another part of it."""
    pinned = np.zeros(len(garment.vertices), bool)
    pinned[garment.pins.vertices] = True
    vertices = push_out_of_body(garment.vertices, body_tree(body), CLEARANCE, fixed=pinned)
    return replace(garment, vertices=vertices.astype(np.float32))


def _refuse_places(path: Path, said: GarmentFile) -> None:
    wrong = {"unit": said.unit, "origin": said.origin, "up": said.up if said.up != "y" else None}
    wrong |= {"pattern": said.pattern or None}
    if given := [key for key, value in wrong.items() if value is not None]:
        what, cure = f"{path}: clothes that are bound to the body have a place and no pattern", f"remove '{given[0]}'"
        raise BadGarment(what, f"{given[0]} = {wrong[given[0]]!r}", cure)


def _cut_note(said: GarmentFile) -> str:
    shape = "mean shape" if said.betas is None else "shape that 'betas' says"
    return f"rest shape: the mesh itself on the {shape}; vertices follow the body's shape by their bindings"


def _parts(
    whole: Cloth, cut: Vertices, cut_for: "ShapedBody"
) -> tuple[list[Int[np.ndarray, " part"]], tuple[str, ...]]:
    """Vertices of each component that is cloth, from the skin outwards, and notes about the others."""
    number = components(whole.faces, len(cut))
    parts, notes = [], []
    if number.max() >= _COMPONENTS_MAX:
        what = f"{whole.name} may have {_COMPONENTS_MAX} components"
        raise BadGarment(what, int(number.max()) + 1, "merge vertices at equal places, and export it again")
    for each in range(number.max() + 1):
        ids = np.flatnonzero(number == each)
        size = float(np.ptp(cut[ids], axis=0).max())
        if size >= SMALLEST:
            parts.append(ids)
            continue
        got = f"{len(ids)} vertices from {ids[0]} on, {1000 * size:.0f} mm"
        notes.append(f"left out: a button or the like ({got}), which would fall off")
    if not parts:
        cure = f"name a file with a component of {100 * SMALLEST:.0f} cm or more"
        raise BadGarment(f"{whole.name} must have cloth", f"{len(notes)} components, all smaller", cure)
    if len(parts) > _PIECES_MAX:
        what = f"{whole.name} may have {_PIECES_MAX} pieces of cloth"
        raise BadGarment(what, len(parts), "merge vertices at equal places, or export its pieces one by one")
    return _from_the_skin(parts, whole.faces, cut, cut_for), tuple(notes)


def _from_the_skin(parts: list[np.ndarray], faces: Faces, cut: Vertices, shaped: "ShapedBody") -> list[np.ndarray]:
    """Components sorted by how many others they lie over, where they overlap."""
    skin = body_tree(shaped)
    over = []
    for outer in parts:
        height = skin.signed_distances(cut[outer])
        beneath = 0
        for inner in parts:
            if inner is not outer:
                closest = ClosestTree(cut, faces[np.isin(faces[:, 0], inner)]).closest(cut[outer])
                near = closest.distances < _NEAR
                rise = height[near] - skin.signed_distances(closest.positions[near])
                beneath += bool(near.any() and rise.mean() > 0)
        over.append(beneath)
    return [parts[index] for index in np.argsort(over, kind="stable")]


def _piece(whole: Cloth, ids: np.ndarray, number: int, count: int, said: GarmentFile, body: "ShapedBody") -> Garment:
    """One component as a garment."""
    place = np.full(len(whole.vertices), -1)
    place[ids] = np.arange(len(ids))
    own = place[whole.faces[:, 0]] >= 0
    vertices = whole.vertices[ids]
    name = whole.name if count == 1 else f"{whole.name} {number}"
    height = np.ptp(vertices[:, 1])
    size = f"{len(ids)} vertices, the first is {ids[0]} of the OBJ, {height:.2f} m high"
    note = f"component {number} of {count} from the skin outwards: {size}"
    faces = place[whole.faces[own]].astype(np.int32)
    cloth = Cloth(name, vertices, faces, whole.rest_edges[own], False, (note,) if count > 1 else (), coarse=True)
    return assembled(cloth, _renumbered(said, place), body)


def _renumbered(said: GarmentFile, place: np.ndarray) -> GarmentFile:
    """What a TOML says about the vertices of one component, by their new ids."""

    def kept(ids: tuple[int, ...]) -> tuple[int, ...]:
        beyond = [each for each in ids if not 0 <= each < len(place)]
        return tuple(beyond or (int(place[each]) for each in ids if place[each] >= 0))

    def group(each: PinGroup) -> PinGroup:
        return replace(each, vertices=kept(each.vertices)) if isinstance(each.vertices, tuple) else each

    pins = said.pins
    if isinstance(pins, tuple):
        by_group = bool(pins) and isinstance(pins[0], PinGroup)
        pins = tuple(group(each) for each in pins) if by_group else kept(pins)  # type: ignore[arg-type]
    chains = tuple(chain for chain in map(kept, said.chains) if chain)
    return replace(said, pins=pins, chains=chains)
