"""A garment from a mesh file, with or without the TOML beside it."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hemline.errors import BadGarment
from hemline.meshes import ClosestTree, ReadMesh, check_mesh, consistent_winding, read_mesh, vertex_normals

from .dressing import body_tree
from .garment import Garment
from .garment_toml import GarmentFile, read_garment_toml
from .material import Material
from .pin_rules import bound_pins, guessed_key_joint
from .pins import Pins
from .placement import on_body, outside_body
from .rest_shape import rest_shape, rewound
from .units import UNITS, unit_of

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

_FARTHEST_PIN = 0.15


def read(path: str | Path, body: "ShapedBody | None" = None, unit: str | None = None) -> Garment:
    """Read a garment: a TOML that names its mesh, a mesh alone (all else is guessed), or a hemline file.

    What was guessed or changed is in the garment's `notes`.

    Args:
        path: A `.toml`, `.obj`, `.ply`, `.glb`, `.stl` or `.safetensors` file.
        body: The body to wear it. Without a TOML that says otherwise, also the one it was made on; None: the mean
            `anny24`.
        unit: Unit of the mesh (m, dm, cm, mm, in, ft); None: as the TOML says, or guessed from the size.

    Returns:
        The garment on `body`.

    Raises:
        BadGarment: Unit, pins, chains, material or position on the body contradict each other.
        BadMesh: The mesh cannot be read, or no cloth can be made of it.
    """
    path = Path(path)
    if path.suffix == ".safetensors":
        garment = Garment.load(path)
        return garment if body is None else _worn(garment, body)
    said = read_garment_toml(path) if path.suffix == ".toml" else GarmentFile(mesh=path.name)
    made_on, notes = _body_made_on(said, body, path)
    garment = _assembled(path, said, made_on, unit or said.unit, notes)
    return garment if body is None else _worn(garment, body)


def _worn(garment: Garment, body: "ShapedBody") -> Garment:
    same = garment.body_name == body.body.name and np.array_equal(_padded(garment.body_betas), _padded(body.betas))
    return garment if same else garment.dressed(body)


def _padded(betas: np.ndarray) -> np.ndarray:
    return np.trim_zeros(np.asarray(betas, np.float32), "b")


def _body_made_on(said: GarmentFile, body: "ShapedBody | None", path: Path) -> tuple["ShapedBody", tuple[str, ...]]:
    from hemline import bodies

    if body is not None and said.body not in (None, body.body.name):
        cure = f"use the body {said.body}, or correct 'body'"
        raise BadGarment(f"{path} was made on the body '{said.body}'", f"'{body.body.name}' to wear it", cure)
    if body is not None and said.betas is None:
        return body, ()
    base = body.body if body is not None else bodies.load(said.body or "anny24")
    notes = () if said.body or body else ("body: anny24, as none was named",)
    return base.shaped(said.betas or ()), notes


def _assembled(path: Path, said: GarmentFile, body: "ShapedBody", unit: str | None, notes: tuple[str, ...]) -> Garment:
    name = said.name or path.stem
    mesh = read_mesh(path.parent / said.mesh)
    notes += mesh.notes + check_mesh(mesh.vertices, mesh.faces, name=name)
    _refuse_loose_vertices(mesh, name)
    found_unit, unit_notes = unit_of(mesh.vertices, unit, name)
    scale = UNITS[found_unit]
    vertices = mesh.vertices * scale
    if said.up == "z":
        vertices = vertices[:, [0, 2, 1]] * (1, 1, -1)
    rest_edges, from_pattern, metric_notes = rest_shape(mesh, vertices, scale, said.pattern, name)
    tree = body_tree(body)
    vertices, placed = on_body(vertices, tree, said.origin, name)
    faces, turned = _wound_outward(vertices, mesh.faces, tree)
    rest_edges = rewound(rest_edges, mesh.faces, faces)
    vertices, moved = outside_body(vertices, tree, name)
    pins, pin_notes = bound_pins(said.pins, vertices, faces, body, name)
    _refuse_far_pins(pins, name)
    key_joint, key_notes = (said.key_joint, ()) if said.key_joint else guessed_key_joint(pins, body)
    material_notes = () if said.material is not None else ("material: cotton, as none was named",)
    notes += unit_notes + metric_notes + placed + turned + moved + pin_notes + key_notes + material_notes
    vertices[pins.vertices] = pins.positions(body.vertices, body.normals, body.body.faces, body.joints)
    return Garment(
        name=name,
        vertices=vertices.astype(np.float32),
        faces=faces,
        rest_edges=rest_edges,
        material=Material.of(said.material if said.material is not None else "cotton"),
        pins=pins,
        key_joint=key_joint,
        chains=said.chains,
        body_name=body.body.name,
        body_betas=np.array(body.betas, np.float32),
        flat_rest=from_pattern if said.flat_rest is None else said.flat_rest,
        notes=notes,
    )


def _refuse_loose_vertices(mesh: ReadMesh, name: str) -> None:
    used = np.bincount(mesh.faces.reshape(-1), minlength=len(mesh.vertices)) > 0
    if not used.all():
        got = f"{(~used).sum()} of {len(used)}, the first is {int(np.argmin(used))}"
        raise BadGarment(
            f"{name} must not have vertices without a triangle", got, "delete loose vertices and export again"
        )


def _wound_outward(vertices: np.ndarray, faces: np.ndarray, tree: ClosestTree) -> tuple[np.ndarray, tuple[str, ...]]:
    faces, count = consistent_winding(faces)
    notes = ("winding: they were turned to agree",) if count else ()
    closest = tree.closest(vertices)
    side = (tree.outward(closest) * vertex_normals(vertices, faces)).sum(axis=1)
    if (side > 0).mean() < 0.5:
        return np.ascontiguousarray(faces[:, [0, 2, 1]]), (
            *notes,
            "winding: all triangles were turned to face away from the body",
        )
    return faces, notes


def _refuse_far_pins(pins: Pins, name: str) -> None:
    heights = pins.heights[pins.joints < 0]
    if len(heights) and np.median(heights) > _FARTHEST_PIN:
        got = f"half of them more than {np.median(heights):.2f} m away from it"
        raise BadGarment(f"{name}: pins must be near the body", got, "name other 'pins', or place it on the body")
