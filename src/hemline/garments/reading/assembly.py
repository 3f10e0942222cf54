"""What is common to all garments that are read: cloth on a body is turned outward, moved out of it, pinned."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Faces, Float, Vertices
from hemline.errors import BadGarment, OffBody
from hemline.garments.dressing import body_tree
from hemline.garments.garment import Garment
from hemline.garments.material import Material
from hemline.garments.pin_rules import bound_pins, guessed_key_joint
from hemline.garments.pins import Pins
from hemline.meshes import ClosestTree, check_mesh, consistent_winding, vertex_normals

from .cover import covering
from .garment_toml import GarmentFile
from .placement import outside_body
from .rest_shape import rewound

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

_FARTHEST_PIN = 0.15


@dataclass(frozen=True, eq=False)
class Cloth:
    """A mesh that is on its body."""

    name: str
    """Name of the garment."""
    vertices: Vertices
    """Positions on the body at rest, float64 [m]."""
    faces: Faces
    """Triangles, wound alike."""
    rest_edges: Float[np.ndarray, "faces 2 2"]
    """Flat rest triangles of them [m]."""
    from_pattern: bool
    """Whether they come from a flat pattern."""
    notes: tuple[str, ...]
    """What was guessed or changed so far."""
    coarse: bool = False
    """Whether its triangles are so large that skin may come through them, and are raised there."""


def assembled(cloth: Cloth, said: GarmentFile, body: "ShapedBody") -> Garment:
    """The garment that a mesh on its body makes.

    Args:
        cloth: The mesh.
        said: Pins, chains, key joint and material; what is not said is guessed.
        body: The body that it is on.

    Raises:
        OffBody: The cloth is too deep inside the body, or the pins are far from it.
        BadGarment: Pins contradict the mesh.
    """
    tree = body_tree(body)
    cloth = _turned_outward(cloth, tree)
    vertices, moved = outside_body(cloth.vertices, tree, cloth.name)
    if cloth.coarse:
        vertices, raised = covering(vertices, cloth.faces, body)
        moved += raised
    pins, pin_notes = bound_pins(said.pins, vertices, cloth.faces, body, cloth.name)
    _refuse_far_pins(pins, cloth.name)
    key_joint, key_notes = (said.key_joint, ()) if said.key_joint else guessed_key_joint(pins, body)
    material_notes = () if said.material is not None else ("material: cotton, as none was named",)
    vertices[pins.vertices] = pins.positions(body.vertices, body.normals, body.body.faces, body.joints)
    return Garment(
        name=cloth.name,
        vertices=vertices.astype(np.float32),
        faces=cloth.faces,
        rest_edges=cloth.rest_edges,
        material=Material.of(said.material if said.material is not None else "cotton"),
        pins=pins,
        key_joint=key_joint,
        chains=said.chains,
        body_name=body.body.name,
        body_betas=np.array(body.betas, np.float32),
        flat_rest=cloth.from_pattern if said.flat_rest is None else said.flat_rest,
        notes=cloth.notes + moved + pin_notes + key_notes + material_notes,
    )


def body_made_on(said: GarmentFile, body: "ShapedBody | None", path: Path) -> tuple["ShapedBody", tuple[str, ...]]:
    """The body that a garment was made on, and a note where it was guessed.

    Args:
        said: May name it and its shape.
        body: The body to wear the garment; without a shape in `said`, also the one it was made on.
        path: The garment's file.

    Raises:
        BadGarment: It was made on another body than the one to wear it.
    """
    from hemline import bodies

    if body is not None and said.body not in (None, body.body.name):
        cure = f"use the body {said.body}, or correct 'body'"
        raise BadGarment(f"{path} was made on the body '{said.body}'", f"'{body.body.name}' to wear it", cure)
    if body is not None and said.betas is None:
        return body, ()
    base = body.body if body is not None else bodies.load(said.body or "anny24")
    notes = () if said.body or body else ("body: anny24, as none was named",)
    return base.shaped(said.betas or ()), notes


def checked_mesh(vertices: Vertices, faces: Faces, name: str) -> tuple[str, ...]:
    """What is odd about a garment's mesh, in words.

    Raises:
        BadMesh: As `check_mesh`.
        BadGarment: A vertex belongs to no triangle.
    """
    notes = check_mesh(vertices, faces, name=name)
    used = np.bincount(faces.reshape(-1), minlength=len(vertices)) > 0
    if not used.all():
        got = f"{(~used).sum()} of {len(used)}, the first is {int(np.argmin(used))}"
        raise BadGarment(
            f"{name} must not have vertices without a triangle", got, "delete loose vertices and export again"
        )
    return notes


def wound_alike(cloth: Cloth) -> Cloth:
    """The same cloth, its triangles wound alike where they were not: its openings are found by that."""
    faces, turned = consistent_winding(cloth.faces)
    if not turned:
        return cloth
    note = f"winding: {turned} triangles were turned to agree with their neighbours"
    rest_edges = rewound(cloth.rest_edges, cloth.faces, faces)
    return replace(cloth, faces=faces, rest_edges=rest_edges, notes=(*cloth.notes, note))


def _turned_outward(cloth: Cloth, tree: ClosestTree) -> Cloth:
    side = (tree.outward(tree.closest(cloth.vertices)) * vertex_normals(cloth.vertices, cloth.faces)).sum(axis=1)
    if (side > 0).mean() >= 0.5:
        return cloth
    faces = np.ascontiguousarray(cloth.faces[:, [0, 2, 1]])
    note = "winding: all triangles were turned to face away from the body"
    rest_edges = rewound(cloth.rest_edges, cloth.faces, faces)
    return replace(cloth, faces=faces, rest_edges=rest_edges, notes=(*cloth.notes, note))


def _refuse_far_pins(pins: Pins, name: str) -> None:
    heights = pins.heights[pins.joints < 0]
    if len(heights) and np.median(heights) > _FARTHEST_PIN:
        got = f"half of them more than {np.median(heights):.2f} m away from it"
        cure = "name other 'pins', place it on the body, or have it tried on (hemline tryon)"
        raise OffBody(f"{name}: pins must be near the body", got, cure)
