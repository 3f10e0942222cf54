"""Clothes that ship as files: T-shirt, long-sleeved shirt, trousers, dress."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from hemline.errors import BadGarment
from hemline.garments.proxy.finer import finer

from .garment import Garment

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

FOLDER = Path(__file__).parents[1] / "models" / "wardrobe"

WARDROBE = ("tshirt", "longsleeve", "trousers", "dress")
"""Names of the paper's size, four times the light one, which is `NAME-light`."""


def wardrobe_names() -> tuple[str, ...]:
    """Both sizes of all."""
    return tuple(f"{name}{size}" for name in WARDROBE for size in ("", "-light"))


def wardrobe_garment(name: str, shaped: "ShapedBody") -> Garment:
    """One of `wardrobe_names`, on a shape of `anny24`.

    Args:
        name: Its name.
        shaped: The body.

    Raises:
        BadGarment: A body other than `anny24`, on which these were made.
    """
    light = Garment.load(FOLDER / f"{name.removesuffix('-light')}.safetensors")
    if shaped.body.name != light.body_name:
        what, cure = f"garment '{name}' was made on {light.body_name}", "try its mesh on: hemline tryon MESH"
        raise BadGarment(what, f"a body called {shaped.body.name}", cure)
    worn = light.dressed(shaped)
    return replace(worn if name.endswith("-light") else finer(worn, shaped), name=name)
