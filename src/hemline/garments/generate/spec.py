"""Generates garments by name: `KIND:SEED`, `KIND:SEED@EDGE` (edge length in millimetres) or `close-KIND:SEED`."""

import re
from typing import TYPE_CHECKING, cast

from hemline.bodies import own_size
from hemline.errors import BadGarment
from hemline.garments.garment import Garment

from .design import KINDS, Kind
from .generate_garment import LONGEST_EDGE, SHORTEST_EDGE, generate_garment
from .random_design import random_design

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

_SPEC = re.compile(r"(close-)?([a-z]+):(\d{1,9})(?:@(\d{1,3}))?")


def is_spec(name: str) -> bool:
    """Whether a name is that of a generated garment: it has a colon and begins with a kind."""
    return name.partition(":")[0].removeprefix("close-") in KINDS and ":" in name


def garment_of_spec(name: str, shaped: "ShapedBody") -> Garment:
    """Generates the garment of a name such as `dress:7` or `dress:7@35`: the random design of seed 7.

    On a body of unusual size, such as a child's, the measures of the design are scaled by it.

    Args:
        name: Kind, seed and, unless it is 20 mm, the edge length [mm]; `close-` before it makes the design fit closely.
        shaped: The body to wear it.

    Returns:
        The garment, called `dress-7` or `close-dress-7`.

    Raises:
        BadGarment: The name cannot be parsed, or the garment cannot be generated on this body.
    """
    match = _SPEC.fullmatch(name)
    least, most = round(1000 * SHORTEST_EDGE), round(1000 * LONGEST_EDGE)
    edge = int(match[4] or 20) if match else 0
    if not match or match[2] not in KINDS or not least <= edge <= most:
        cure = f"name it KIND:SEED or KIND:SEED@EDGE, the edge from {least} to {most} mm, such as dress:7@35"
        raise BadGarment("a generated garment's name cannot be read", f"'{name}'", cure)
    kind, seed, close = cast(Kind, match[2]), int(match[3]), match[1] or ""
    design = random_design(kind, seed, close=bool(close)).scaled(own_size(shaped))
    return generate_garment(design, shaped, edge=edge / 1000, name=f"{close}{kind}-{seed}")
