"""Reads clothes of MakeHuman onto the shipped body, of any shape."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Faces, Int, Vertices
from hemline.errors import BadGarment, OffBody
from hemline.garments.clearance import push_out_of_body
from hemline.garments.dressing import CLEARANCE, body_tree
from hemline.garments.garment import Garment
from hemline.garments.pin_rules import PinGroup
from hemline.garments.rest_metric import rest_edges_of_mesh
from hemline.garments.wear_together import wear_together
from hemline.meshes import ClosestTree, check_mesh, components, read_obj

from .assembly import assemble, body_made_on
from .cloth import GarmentCloth, wind_consistently
from .garment_toml import GarmentFile
from .mhclo import BASE_MESH, read_mhclo
from .source import GarmentSource

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

SMALLEST_CLOTH = 0.05
"""Smallest size of a component that is cloth; smaller ones are buttons and the like [m]."""

_OVERLAP_DISTANCE = 0.03
"""Components lie over each other where they are nearer than this [m]."""
_COMPONENTS_MAX = 2_000
"""Largest number of components of clothes, buttons among them."""
_PIECES_MAX = 30
"""Largest number of pieces of cloth: each is compared with each other one."""


def read_clothes(source: GarmentSource, body: "ShapedBody | None") -> Garment:
    """Reads clothes of MakeHuman. Their bindings move vertices with the body's shape; their cut is of the mean shape.

    Components that are not connected become pieces, from the skin outwards, each with pins of its own. Buttons and
    the like are left out.

    Args:
        source: The `.mhclo`, or the TOML that names one. The TOML's `betas` are the shape that the clothes are cut
            for, and its vertex ids are those of the OBJ.
        body: The body to wear them; None: that shape.

    Raises:
        BadBody: Another body than the one that was made from MakeHuman's mesh.
        BadGarment: As `read_mhclo`; a TOML that says where the mesh is; or bindings that do not fit the mesh.
        OffBody: The clothes are too deep inside the body.
        BadMesh: The OBJ cannot be read, or no cloth can be made of it.
    """
    from hemline.bodies.base_mesh import base_mesh

    path, description = source.path, source.description
    _refuse_places(path, description)
    base = base_mesh(BASE_MESH)
    bindings = read_mhclo(source.mesh_path, len(base))
    mesh = read_obj(bindings.mesh)
    if len(mesh.vertices) != len(bindings.corners):
        what = f"{path} must bind each vertex of {bindings.mesh.name}"
        raise BadGarment(what, f"{len(bindings.corners)} bindings, {len(mesh.vertices)} vertices", "export both again")
    made_on, notes = body_made_on(description, body, path)
    cut_for = made_on.body.shaped(description.betas or ())
    wearer = body or cut_for
    cut, on_wearer = (bindings.on(base.on(each)) for each in (cut_for, wearer))
    name = description.name or bindings.name
    notes += (*bindings.notes, *mesh.notes, *check_mesh(cut, mesh.faces, name=name), _cut_note(description))
    notes += ("bindings: body vertices that the file hides are kept",)
    whole = wind_consistently(
        GarmentCloth(name, on_wearer, mesh.faces, rest_edges_of_mesh(cut, mesh.faces), False, notes)
    )
    parts, omitted = _parts(whole, cut, cut_for)
    pieces = [_piece(whole, ids, number, len(parts), description, wearer) for number, ids in enumerate(parts, 1)]
    garment = pieces[0] if len(pieces) == 1 else wear_together(pieces, name=name)
    return _push_out(replace(garment, notes=(*whole.notes, *omitted, *garment.notes)), wearer)


def _push_out(garment: Garment, body: "ShapedBody") -> Garment:
    """Moves the garment out of the body once more: layering and raising brought it near to other parts of the body."""
    pinned = np.zeros(len(garment.vertices), bool)
    pinned[garment.pins.vertices] = True
    vertices = push_out_of_body(garment.vertices, body_tree(body), CLEARANCE, fixed=pinned)
    return replace(garment, vertices=vertices.astype(np.float32))


def _refuse_places(path: Path, description: GarmentFile) -> None:
    wrong = {"unit": description.unit, "origin": description.origin}
    wrong |= {"up": description.up if description.up != "y" else None, "pattern": description.pattern or None}
    if given := [key for key, value in wrong.items() if value is not None]:
        what, cure = f"{path}: clothes that are bound to the body have a place and no pattern", f"remove '{given[0]}'"
        raise BadGarment(what, f"{given[0]} = {wrong[given[0]]!r}", cure)


def _cut_note(description: GarmentFile) -> str:
    shape = "mean shape" if description.betas is None else "shape that 'betas' says"
    return f"rest shape: the mesh itself on the {shape}; vertices follow the body's shape by their bindings"


def _parts(
    whole: GarmentCloth, cut: Vertices, cut_for: "ShapedBody"
) -> tuple[list[Int[np.ndarray, " part"]], tuple[str, ...]]:
    """Returns the vertices of each component that is cloth, from the skin outwards, and notes about the others."""
    number = components(whole.faces, len(cut))
    parts, notes = [], []
    if number.max() >= _COMPONENTS_MAX:
        what = f"{whole.name} may have {_COMPONENTS_MAX} components"
        raise BadGarment(what, int(number.max()) + 1, "merge vertices at equal places, and export it again")
    for each in range(number.max() + 1):
        ids = np.flatnonzero(number == each)
        size = float(np.ptp(cut[ids], axis=0).max())
        if size >= SMALLEST_CLOTH:
            parts.append(ids)
            continue
        got = f"{len(ids)} vertices from {ids[0]} on, {1000 * size:.0f} mm"
        notes.append(f"left out: a button or the like ({got}), which would fall off")
    if not parts:
        cure = f"name a file with a component of {100 * SMALLEST_CLOTH:.0f} cm or more"
        raise BadGarment(f"{whole.name} must have cloth", f"{len(notes)} components, all smaller", cure)
    if len(parts) > _PIECES_MAX:
        what = f"{whole.name} may have {_PIECES_MAX} pieces of cloth"
        raise BadGarment(what, len(parts), "merge vertices at equal places, or export its pieces one by one")
    return _from_the_skin(parts, whole.faces, cut, cut_for), tuple(notes)


def _from_the_skin(parts: list[np.ndarray], faces: Faces, cut: Vertices, shaped: "ShapedBody") -> list[np.ndarray]:
    """Sorts components by how many others they lie over."""
    skin = body_tree(shaped)
    counts = []
    for outer in parts:
        height = skin.signed_distances(cut[outer])
        beneath = 0
        for inner in parts:
            if inner is not outer:
                closest = ClosestTree(cut, faces[np.isin(faces[:, 0], inner)]).closest(cut[outer])
                near = closest.distances < _OVERLAP_DISTANCE
                rise = height[near] - skin.signed_distances(closest.positions[near])
                beneath += bool(near.any() and rise.mean() > 0)
        counts.append(beneath)
    return [parts[index] for index in np.argsort(counts, kind="stable")]


def _piece(
    whole: GarmentCloth, ids: np.ndarray, number: int, count: int, description: GarmentFile, body: "ShapedBody"
) -> Garment:
    """Makes a garment of one component."""
    new_ids = np.full(len(whole.vertices), -1)
    new_ids[ids] = np.arange(len(ids))
    own = new_ids[whole.faces[:, 0]] >= 0
    vertices = whole.vertices[ids]
    name = whole.name if count == 1 else f"{whole.name} {number}"
    height = np.ptp(vertices[:, 1])
    size = f"{len(ids)} vertices, the first is {ids[0]} of the OBJ, {height:.2f} m high"
    note = f"component {number} of {count} from the skin outwards: {size}"
    faces = new_ids[whole.faces[own]].astype(np.int32)
    cloth = GarmentCloth(name, vertices, faces, whole.rest_edges[own], False, (note,) if count > 1 else (), coarse=True)
    garment = assemble(cloth, _renumber(description, new_ids), body)
    if isinstance(garment, OffBody):
        raise garment
    return garment


def _renumber(description: GarmentFile, new_ids: np.ndarray) -> GarmentFile:
    """Translates vertex ids into those of one component; ids of other components are dropped."""

    def translate(ids: tuple[int, ...]) -> tuple[int, ...]:
        beyond = [each for each in ids if not 0 <= each < len(new_ids)]
        return tuple(beyond or (int(new_ids[each]) for each in ids if new_ids[each] >= 0))

    def group(each: PinGroup) -> PinGroup:
        return replace(each, vertices=translate(each.vertices)) if isinstance(each.vertices, tuple) else each

    pins = description.pins
    if isinstance(pins, tuple):
        by_group = bool(pins) and isinstance(pins[0], PinGroup)
        pins = tuple(group(each) for each in pins) if by_group else translate(pins)  # type: ignore[arg-type]
    chains = tuple(chain for chain in map(translate, description.chains) if chain)
    return replace(description, pins=pins, chains=chains)
