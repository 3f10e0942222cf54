"""Makes a garment of cloth that lies on a body: turned outward, moved out of the body, pinned."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hemline.errors import BadGarment, OffBody
from hemline.garments.dressing import body_tree
from hemline.garments.garment import Garment
from hemline.garments.material import Material
from hemline.garments.pin_rules import bind_pins, guess_key_joint
from hemline.garments.pins import Pins

from .cloth import GarmentCloth, wind_outward
from .garment_toml import GarmentFile
from .guessed_pins import guess_pins
from .placement import move_outside_body
from .raise_over_skin import raise_over_skin

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

_FARTHEST_PIN = 0.15


def assemble(cloth: GarmentCloth, description: GarmentFile, body: "ShapedBody") -> Garment | OffBody:
    """Makes a garment of a mesh that lies on its body.

    Args:
        cloth: The mesh.
        description: Pins, chains, key joint and material; what it omits is guessed.
        body: The body that the mesh lies on.

    Returns:
        The garment; or, if the cloth is too deep inside the body or its pins are far from it, the error that says so.

    Raises:
        BadGarment: Pins contradict the mesh.
    """
    tree = body_tree(body)
    cloth = wind_outward(cloth, tree)
    outside = move_outside_body(cloth.vertices, tree, cloth.name)
    if isinstance(outside, OffBody):
        return outside
    vertices, moved = outside
    if cloth.coarse:
        vertices, raised = raise_over_skin(vertices, cloth.faces, body)
        moved += raised
    rule, shoulder_notes = description.pins, ()
    if rule is None:
        rule, shoulder_notes = guess_pins(vertices, cloth.faces, body)
    pins, pin_notes = bind_pins(rule, vertices, cloth.faces, body, cloth.name)
    if too_far := _far_pins(pins, cloth.name):
        return too_far
    key_joint, key_notes = (description.key_joint, ()) if description.key_joint else guess_key_joint(pins, body)
    material_notes = () if description.material is not None else ("material: cotton, as none was named",)
    vertices[pins.vertices] = pins.positions(body.vertices, body.normals, body.body.faces, body.joints)
    return Garment(
        name=cloth.name,
        vertices=vertices.astype(np.float32),
        faces=cloth.faces,
        rest_edges=cloth.rest_edges,
        material=Material.of(description.material if description.material is not None else "cotton"),
        pins=pins,
        key_joint=key_joint,
        chains=description.chains,
        body_name=body.body.name,
        body_betas=np.array(body.betas, np.float32),
        flat_rest=cloth.from_pattern if description.flat_rest is None else description.flat_rest,
        notes=cloth.notes + moved + shoulder_notes + pin_notes + key_notes + material_notes,
    )


def body_made_on(
    description: GarmentFile, body: "ShapedBody | None", path: Path
) -> tuple["ShapedBody", tuple[str, ...]]:
    """Returns the body that a garment was made on, and a note where it was guessed.

    Args:
        description: May name the body and its shape.
        body: The body to wear the garment. If the description has no shape, the garment was made on this one, too.
        path: The garment's file.

    Raises:
        BadGarment: The garment was made on another body than the one to wear it.
    """
    from hemline import bodies

    if body is not None and description.body not in (None, body.body.name):
        cure = f"use the body {description.body}, or correct 'body'"
        raise BadGarment(f"{path} was made on the body '{description.body}'", f"'{body.body.name}' to wear it", cure)
    if body is not None and description.betas is None:
        return body, ()
    base = body.body if body is not None else bodies.load(description.body or "anny24")
    notes = () if description.body or body else ("body: anny24, as none was named",)
    return base.shaped(description.betas or ()), notes


def _far_pins(pins: Pins, name: str) -> OffBody | None:
    heights = pins.heights[pins.joints < 0]
    if not len(heights) or np.median(heights) <= _FARTHEST_PIN:
        return None
    got = f"half of them more than {np.median(heights):.2f} m away from it"
    cure = "name other 'pins', place it on the body, or have it tried on (hemline tryon)"
    return OffBody(f"{name}: pins must be near the body", got, cure)
