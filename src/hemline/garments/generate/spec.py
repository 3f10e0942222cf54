"""Generated garments by name: KIND:SEED, KIND:SEED@EDGE, close-KIND:SEED; the edge in millimetres."""

import re
from typing import TYPE_CHECKING, cast

from hemline.errors import BadGarment
from hemline.garments.garment import Garment

from .design import KINDS, Kind
from .generated import LONGEST, SHORTEST, generate_garment
from .random_design import random_design

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

_SPEC = re.compile(r"(close-)?([a-z]+):(\d{1,9})(?:@(\d{1,3}))?")


def is_spec(name: str) -> bool:
    """Whether a name asks for a generated garment: whether it has a colon and begins with a kind."""
    return name.partition(":")[0].removeprefix("close-") in KINDS and ":" in name


def garment_of_spec(name: str, shaped: "ShapedBody") -> Garment:
    """The garment that a name such as `dress:7` or `dress:7@35` asks for: the random design of seed 7.

    Args:
        name: Kind, seed and, unless they are 20 mm long, the length of its edges [mm]; with `close-` before it the
            design fits closely.
        shaped: The body to wear it.

    Returns:
        The garment, called `dress-7` or `close-dress-7`.

    Raises:
        BadGarment: The name cannot be read, or as `generated`.
    """
    found = _SPEC.fullmatch(name)
    least, most = round(1000 * SHORTEST), round(1000 * LONGEST)
    edge = int(found[4] or 20) if found else 0
    if not found or found[2] not in KINDS or not least <= edge <= most:
        cure = f"name it KIND:SEED or KIND:SEED@EDGE, the edge from {least} to {most} mm, such as dress:7@35"
        raise BadGarment("a generated garment's name cannot be read", f"'{name}'", cure)
    kind, seed, close = cast(Kind, found[2]), int(found[3]), found[1] or ""
    design = random_design(kind, seed, close=bool(close))
    return generate_garment(design, shaped, edge=edge / 1000, name=f"{close}{kind}-{seed}")
