"""A garment from a mesh file, with or without the TOML beside it."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hemline.errors import BadGarment
from hemline.meshes import ClosestTree, ReadMesh, check_mesh, consistent_winding, face_areas, read_mesh, vertex_normals

from .clearance import cleared
from .dressing import CLEARANCE, body_tree
from .garment import Garment
from .garment_toml import GarmentFile, read_garment_toml
from .material import Material
from .pin_rules import guessed_key_joint, pinned_vertices
from .pins import Pins
from .rest_metric import rest_edges_of_mesh, rest_edges_of_pattern
from .units import UNITS, unit_of

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

_DEEPEST = 0.05
_INSIDE_SHARE = 0.3
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
    rest_edges, from_pattern, metric_notes = _rest_metric(mesh, vertices, scale, said.pattern, name)
    tree = body_tree(body)
    faces, turned = _wound_outward(vertices, mesh.faces, tree)
    rest_edges = _rewound(rest_edges, mesh.faces, faces)
    vertices, moved = _outside(vertices, tree, name)
    ids, pin_notes = pinned_vertices(said.pins, vertices, faces, name)
    pins = Pins.bound(ids, vertices[ids], tree, body.normals)
    far = _far_pins(pins)
    key_joint, key_note = (said.key_joint, "") if said.key_joint else guessed_key_joint(pins, body)
    material_note = () if said.material is not None else ("material: cotton, as none was named",)
    notes += (
        unit_notes + metric_notes + turned + moved + pin_notes + far + ((key_note,) if key_note else ()) + material_note
    )
    vertices[ids] = pins.positions(body.vertices, body.normals, body.body.faces)
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


def _rest_metric(
    mesh: ReadMesh, vertices: np.ndarray, scale: float, wanted: bool | None, name: str
) -> tuple[np.ndarray, bool, tuple[str, ...]]:
    """Flat triangles, whether they come from the pattern, and a note where that was guessed."""
    if wanted and mesh.pattern is None:
        raise BadGarment(
            f"{name}: 'pattern' asks for texture coordinates", "a mesh without any", "remove 'pattern', or export them"
        )
    if wanted is False or mesh.pattern is None or mesh.pattern_faces is None:
        return (
            rest_edges_of_mesh(vertices, mesh.faces),
            False,
            ("rest shape: the mesh itself, as it has no pattern",) * (wanted is None),
        )
    flat = rest_edges_of_pattern(mesh.pattern * scale, mesh.pattern_faces)
    share = np.abs(np.linalg.det(flat)).sum() / 2 / face_areas(vertices, mesh.faces).sum()
    degenerate = (np.linalg.det(flat) <= 0).any()
    if 0.7 < share < 1.5 and not degenerate:
        return flat, True, ("rest shape: the pattern (vt), as its area fits the mesh",) * (wanted is None)
    if wanted:
        got = "triangles without an area" if degenerate else f"an area of {share:.3g} times the mesh"
        raise BadGarment(
            f"{name}: texture coordinates must be the pattern, in the unit of the mesh", got, "set pattern = false"
        )
    return (
        rest_edges_of_mesh(vertices, mesh.faces),
        False,
        ("rest shape: the mesh itself, as its vt are no pattern to scale",),
    )


def _wound_outward(vertices: np.ndarray, faces: np.ndarray, tree: ClosestTree) -> tuple[np.ndarray, tuple[str, ...]]:
    faces, count = consistent_winding(faces)
    notes = (f"winding: {count} triangles were turned to agree with their neighbours",) if count else ()
    closest = tree.closest(vertices)
    side = (tree.outward(closest) * vertex_normals(vertices, faces)).sum(axis=1)
    if (side > 0).mean() < 0.5:
        return np.ascontiguousarray(faces[:, [0, 2, 1]]), (
            *notes,
            "winding: all triangles were turned to face away from the body",
        )
    return faces, notes


def _rewound(rest_edges: np.ndarray, before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Flat triangles with their second and third corner exchanged, as `after` has them, mirrored to a positive area."""
    swapped = (before != after).any(axis=1)
    result = rest_edges.copy()
    result[swapped] = rest_edges[swapped][:, :, ::-1]
    result[swapped, 1] *= -1
    return result


def _outside(vertices: np.ndarray, tree: ClosestTree, name: str) -> tuple[np.ndarray, tuple[str, ...]]:
    """Positions moved out of the body, and a note; a garment that is not on the body is refused."""
    distance = tree.signed_distances(vertices)
    inside = distance < 0
    if not (distance < 0.2).any():
        got = f"{distance.min():.2f} m from it at the nearest, centre at {np.round(vertices.mean(axis=0), 2).tolist()}"
        raise BadGarment(
            f"{name} must be on the body", got, "place it on the body at rest (pelvis at the origin, y up, facing +z)"
        )
    if inside.mean() > _INSIDE_SHARE or distance.min() < -_DEEPEST:
        got = f"{inside.sum()} of {len(inside)} vertices inside it, the deepest {-1000 * distance.min():.0f} mm"
        cure = "place it on the body at rest (pelvis at the origin, y up, facing +z), or name the body it was made on"
        raise BadGarment(f"{name} must fit the body at rest", got, cure)
    close = distance < CLEARANCE
    if not close.any():
        return vertices.copy(), ()
    deepest = max(0.0, -1000 * float(distance.min()))
    note = (
        f"{inside.sum()} vertices were inside the body at rest, the deepest {deepest:.1f} mm; "
        f"{close.sum()} were moved to {1000 * CLEARANCE:.0f} mm outside"
    )
    return cleared(vertices, tree, CLEARANCE), (note,)


def _far_pins(pins: Pins) -> tuple[str, ...]:
    if not len(pins) or pins.heights.max() <= _FARTHEST_PIN:
        return ()
    return (f"{(pins.heights > _FARTHEST_PIN).sum()} pins are up to {pins.heights.max():.2f} m away from the skin",)
