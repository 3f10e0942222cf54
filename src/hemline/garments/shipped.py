"""Garments by name: those that ship, and those that are generated."""

from dataclasses import replace
from difflib import get_close_matches
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hemline.errors import BadGarment
from hemline.garments.cut.cape import LIGHT_VERTEX_COUNT, PAPER_VERTEX_COUNT, make_cape
from hemline.garments.cut.skirt import LIGHT_SIZE, PAPER_SIZE, make_skirt
from hemline.garments.proxy.subdivide_garment import subdivide_garment
from hemline.garments.reading.read import put_on
from hemline.motions.motion import JOINT_NAMES

from .garment import Garment
from .generate import garment_of_spec, is_spec
from .pins import Pins

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

WARDROBE_FOLDER = Path(__file__).parents[1] / "models" / "wardrobe"
"""Folder of the clothes that ship as files, all in the light size."""

_CAPES = {"cape": PAPER_VERTEX_COUNT, "cape-light": LIGHT_VERTEX_COUNT}
_SKIRTS = {"skirt": PAPER_SIZE, "skirt-light": LIGHT_SIZE}
_WARDROBE = tuple(f"{name}{size}" for name in ("tshirt", "longsleeve", "trousers", "dress") for size in ("", "-light"))
_NAMES = (*_CAPES, *_SKIRTS, *_WARDROBE)


def names() -> tuple[str, ...]:
    """Returns the names of the garments that ship."""
    return _NAMES


def is_name(name_or_path: str | Path) -> bool:
    """Whether a text is the name of a garment rather than the path of a file: files have an ending."""
    return not Path(name_or_path).suffix or is_spec(str(name_or_path))


def load(name: str = "cape", body: "ShapedBody | None" = None, *, dressed: bool = True) -> Garment:
    """Returns a garment by name.

    Args:
        name: `cape` (12,690 vertices), `cape-light` (4,000), `skirt` (18,546), `skirt-light` (3,978); `tshirt`,
            `longsleeve`, `trousers`, `dress`, each of which has four times the triangles of `tshirt-light` and so on;
            or a generated one, `KIND:SEED` or `KIND:SEED@EDGE`, such as `dress:7` and `dress:7@35` (edges of 35 mm).
        body: The body to wear it; None: the mean `anny24`, for which garments are made once and cached. For any other
            body it is made each time.
        dressed: Whether it is moved onto the shape of `body`; otherwise it stays on the mean shape of `anny24`.

    Raises:
        BadGarment: Unknown name, a file, or a garment that cannot be made on that body.
    """
    if not is_name(name):
        cure = "read a file with 'hemline.garments.read'"
        raise BadGarment("'hemline.garments.load' takes the name of a garment that hemline makes", f"'{name}'", cure)
    if body is not None and body.body.name != "anny24":
        return _make(name, body)
    return put_on(_on_mean_body(name), body, dressed=dressed)


@cache
def _on_mean_body(name: str) -> Garment:
    from hemline import bodies

    return _make(name, bodies.load("anny24").shaped())


def _make(name: str, shaped: "ShapedBody") -> Garment:
    """Makes a garment by name on a body."""
    if is_spec(name):
        return garment_of_spec(name, shaped)
    if name not in _NAMES:
        near = get_close_matches(name, _NAMES, 1, 0.0)[0]
        raise BadGarment("unknown garment", f"'{name}'", f"did you mean '{near}'; or name a file")
    if name in _CAPES:
        return make_cape(shaped, vertex_count=_CAPES[name], name=name)
    if name in _SKIRTS:
        rows, columns = _SKIRTS[name]
        return make_skirt(shaped, rows=rows, columns=columns, name=name)
    return _from_wardrobe(name, shaped)


def _from_wardrobe(name: str, shaped: "ShapedBody") -> Garment:
    """Reads a garment of the wardrobe and moves it onto a shape of the body that it was made on, `anny24`."""
    light = Garment.load(WARDROBE_FOLDER / f"{name.removesuffix('-light')}.safetensors")
    if shaped.body.name != light.body_name:
        what, cure = f"garment '{name}' was made on {light.body_name}", "try its mesh on: hemline tryon MESH"
        raise BadGarment(what, f"a body called {shaped.body.name}", cure)
    on_body = light.dressed(shaped)
    return replace(on_body if name.endswith("-light") else subdivide_garment(on_body, shaped), name=name)


def explain(garment: Garment) -> str:
    """Describes a garment, and what was guessed or changed when it was made, one line each."""
    size = " x ".join(f"{each:.2f}" for each in garment.vertices.max(axis=0) - garment.vertices.min(axis=0))
    materials = ", ".join(piece.material.name for piece in garment.layers)
    pins = _describe_pins(garment.pins)
    lines = [
        f"{garment.name}: {len(garment.vertices)} vertices, {len(garment.faces)} triangles, {size} m",
        f"material {materials}, {pins}, carried by the {garment.key_joint}, on {garment.body_name}",
    ]
    return "\n".join(lines + [f"- {note}" for note in garment.notes])


def _describe_pins(pins: Pins) -> str:
    if not len(pins):
        return "no pins"
    on_skin, soft = pins.heights[pins.joints < 0], pins.stiffness[np.isfinite(pins.stiffness)]
    text = f"{len(pins)} pins"
    if len(on_skin):
        text += f", {1000 * on_skin.min():.1f} to {1000 * on_skin.max():.1f} mm above the skin"
    if len(on_skin) < len(pins):
        carriers = sorted({JOINT_NAMES[joint] for joint in pins.joints if joint >= 0})
        text += f", {len(pins) - len(on_skin)} on joints ({', '.join(carriers)})"
    if len(soft):
        text += f", {len(soft)} of them springs of {soft.min():.3g} to {soft.max():.3g} N/m"
    return text
