"""Designs of generated garments: kinds and measures."""

from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

from hemline.errors import BadInput
from hemline.garments.material import MATERIALS

Kind = Literal["top", "dress", "skirt", "trousers", "jumpsuit"]
Neckline = Literal["round", "v", "square"]
KINDS: tuple[Kind, ...] = get_args(Kind)
NECKLINES: tuple[Neckline, ...] = get_args(Neckline)

LIMITS = {
    "length": (0.15, 1.45),
    "ease": (0.0, 0.6),
    "waist_ease": (0.0, 0.6),
    "waist_height": (-0.1, 0.15),
    "flare": (0.0, 0.8),
    "sleeve": (0.0, 0.52),
    "sleeve_ease": (0.0, 0.3),
    "sleeve_flare": (0.0, 0.35),
    "strap": (0.03, 0.14),
    "neck_width": (0.14, 0.28),
    "neck_front": (0.03, 0.22),
    "neck_back": (0.01, 0.2),
    "leg_ease": (0.0, 0.3),
    "leg_taper": (0.0, 1.0),
    "rise": (0.0, 0.08),
}
"""Least and greatest value of each measure."""


@dataclass(frozen=True, kw_only=True)
class Measures:
    """Measures of a garment. Measures that its kind does not have are ignored."""

    length: float = 0.6
    """Vertical distance from the top to the hem [m].
    The top is the shoulder beside the neck, or the waistband of skirts and trousers."""
    ease: float = 0.12
    """Extra girth over that of chest and hips [m]."""
    waist_ease: float = 0.12
    """Extra girth at the waist of tops, dresses and jumpsuits [m]."""
    waist_height: float = 0.0
    """Height above the natural waist of the waistband, or of the line where a dress begins to widen [m]."""
    flare: float = 0.1
    """Angle to the vertical at which the garment widens below the waist [rad].
    Trousers and jumpsuits widen below the knee."""
    sleeve: float = 0.18
    """Length of the sleeves along the arm from the shoulder joint [m]. With 0 there is an armhole without a sleeve."""
    sleeve_ease: float = 0.08
    """Extra girth of a sleeve over that of the arm [m]."""
    sleeve_flare: float = 0.0
    """Angle at which a sleeve widens [rad]."""
    strap: float = 0.09
    """Width of the shoulders of sleeveless garments, from the neckline to the armhole [m]."""
    neck_width: float = 0.18
    """Width of the neckline [m]."""
    neck_front: float = 0.09
    """Depth of the front neckline below the shoulder beside the neck [m]."""
    neck_back: float = 0.03
    """Depth of the back neckline below the shoulder beside the neck [m]."""
    neckline: Neckline = "round"
    """Shape of the neckline: round, v or square."""
    leg_ease: float = 0.08
    """Extra girth of a trouser leg over that of the body's leg [m]."""
    leg_taper: float = 0.3
    """Taper of the trouser legs, from 0 (straight down from the thigh) to 1 (along the leg)."""
    rise: float = 0.02
    """Depth of the crotch below that of the body [m]."""
    material: str = "cotton"
    """Material of the garment: cotton, silk, denim, wool, jersey or paper."""


@dataclass(frozen=True)
class Design(Measures):
    """Kind and measures of a garment.

    Raises:
        BadInput: An unknown kind, neckline or material, or a measure outside its limits.
    """

    kind: Kind
    """Kind of garment: top, dress, skirt, trousers or jumpsuit."""

    def __post_init__(self) -> None:
        _check_choice("kind", self.kind, KINDS)
        _check_choice("neckline", self.neckline, NECKLINES)
        _check_choice("material", self.material, tuple(MATERIALS))
        for name, (low, high) in LIMITS.items():
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
                raise BadInput(f"{name} of a garment must be from {low:g} to {high:g}", repr(value), "stay within that")

    @property
    def has_top(self) -> bool:
        """Whether the garment hangs from the shoulders."""
        return self.kind in ("top", "dress", "jumpsuit")

    def scaled(self, factor: float) -> "Design":
        """Returns this design with its lengths multiplied, within `LIMITS`.

        Args:
            factor: Size of the new garment over that of this one; 1 returns this design.
        """
        if factor == 1:
            return self
        lengths = {name: factor * getattr(self, name) for name in LIMITS if name not in _RATIOS}
        return replace(self, **{name: float(np.clip(value, *LIMITS[name])) for name, value in lengths.items()})

    @property
    def has_legs(self) -> bool:
        """Whether each leg has a tube of its own."""
        return self.kind in ("trousers", "jumpsuit")


_RATIOS = ("flare", "sleeve_flare", "leg_taper")
"""Measures that are no lengths."""


def _check_choice(what: str, value: str, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise BadInput(f"unknown {what} of a generated garment", repr(value), f"use one of {', '.join(choices)}")
