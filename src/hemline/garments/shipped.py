"""Garments by name."""

from difflib import get_close_matches
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hemline.errors import BadGarment
from hemline.garments.cut.cape import LIGHT_VERTEX_COUNT, PAPER_VERTEX_COUNT, make_cape
from hemline.garments.cut.skirt import LIGHT_SIZE, PAPER_SIZE, make_skirt
from hemline.garments.reading.read import read
from hemline.motions.motion import JOINT_NAMES

from .garment import Garment
from .generate import garment_of_spec, is_spec
from .pins import Pins
from .wardrobe import wardrobe_garment, wardrobe_names

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

_CAPES = {"cape": PAPER_VERTEX_COUNT, "cape-light": LIGHT_VERTEX_COUNT}
_SKIRTS = {"skirt": PAPER_SIZE, "skirt-light": LIGHT_SIZE}
_NAMES = (*_CAPES, *_SKIRTS, *wardrobe_names())
_ENDINGS = (".toml", ".obj", ".ply", ".glb", ".gltf", ".stl", ".mhclo", ".safetensors")


def names() -> tuple[str, ...]:
    """Garments that can be loaded by name."""
    return _NAMES


@cache
def load(name: str = "cape") -> Garment:
    """A garment by name, made on the mean `anny24` body and kept.

    Args:
        name: `cape` (12,690 vertices), `cape-light` (4,000), `skirt` (18,546), `skirt-light` (3,978); `tshirt`,
            `longsleeve`, `trousers`, `dress`, each of which has four times the triangles of `tshirt-light` and so on;
            or a generated one, `KIND:SEED` or `KIND:SEED@EDGE`, such as `dress:7` and `dress:7@35` (edges of 35 mm).

    Raises:
        BadGarment: Unknown name.
    """
    from hemline import bodies

    return _made(name, bodies.load("anny24").shaped())


def _made(name: str, shaped: "ShapedBody") -> Garment:
    """A garment by name, made on a body."""
    if is_spec(name):
        return garment_of_spec(name, shaped)
    if name not in _NAMES:
        near = get_close_matches(name, _NAMES, 1, 0.0)[0]
        raise BadGarment("unknown garment", f"'{name}'", f"did you mean '{near}'; or name a file")
    if name in _CAPES:
        return make_cape(shaped, vertex_count=_CAPES[name], name=name)
    if name in wardrobe_names():
        return wardrobe_garment(name, shaped)
    rows, columns = _SKIRTS[name]
    return make_skirt(shaped, rows=rows, columns=columns, name=name)


def open_garment(name_or_path: str | Path, body: "ShapedBody | None" = None, *, dressed: bool = True) -> Garment:
    """A garment by name, or from a file as `read` does, on a body.

    Args:
        name_or_path: A name of `names()`, a generated one such as `dress:7`, or a path with a known ending.
        body: The body to wear it; None: the one it was made on. A garment by name is made anew on another body than
            `anny24`.
        dressed: Whether it is moved onto `body`; otherwise it stays on the shape that it was made on, as in `read`.

    Raises:
        BadGarment: Unknown name, or as `read`.
        BadMesh: As `read`.
    """
    if Path(name_or_path).suffix.lower() in _ENDINGS:
        return read(name_or_path, body, dressed=dressed)
    if body is not None and body.body.name != "anny24":
        return _made(str(name_or_path), body)
    garment = load(str(name_or_path))
    return garment.dressed(body) if dressed and body is not None else garment


def explain(garment: Garment) -> str:
    """What a garment is, and what was guessed or changed when it was made, one line each."""
    size = " x ".join(f"{each:.2f}" for each in garment.vertices.max(axis=0) - garment.vertices.min(axis=0))
    materials = ", ".join(piece.material.name for piece in garment.worn)
    lines = [
        f"{garment.name}: {len(garment.vertices)} vertices, {len(garment.faces)} triangles, {size} m",
        f"material {materials}, {_pinned(garment.pins)}, carried by the {garment.key_joint}, on {garment.body_name}",
    ]
    return "\n".join(lines + [f"- {note}" for note in garment.notes])


def _pinned(pins: Pins) -> str:
    if not len(pins):
        return "no pins"
    on_skin, soft = pins.heights[pins.joints < 0], pins.stiffness[np.isfinite(pins.stiffness)]
    said = f"{len(pins)} pins"
    if len(on_skin):
        said += f", {1000 * on_skin.min():.1f} to {1000 * on_skin.max():.1f} mm above the skin"
    if len(on_skin) < len(pins):
        carriers = sorted({JOINT_NAMES[joint] for joint in pins.joints if joint >= 0})
        said += f", {len(pins) - len(on_skin)} on joints ({', '.join(carriers)})"
    if len(soft):
        said += f", {len(soft)} of them springs of {soft.min():.3g} to {soft.max():.3g} N/m"
    return said
