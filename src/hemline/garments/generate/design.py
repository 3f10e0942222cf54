"""What a generated garment is: its kind and its measures."""

from dataclasses import dataclass
from typing import Literal, get_args

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
    """The measures of a garment; what its kind does not use is ignored."""

    length: float = 0.6
    """From its top down to the hem, measured vertically: from the shoulder beside the neck, or from the waistband of
    skirts and trousers [m]."""
    ease: float = 0.12
    """How much longer its girth is than that of chest and hips [m]."""
    waist_ease: float = 0.12
    """The same at the waist of tops, dresses and jumpsuits [m]."""
    waist_height: float = 0.0
    """Height of the waistband, or where a dress begins to widen, above the natural waist [m]."""
    flare: float = 0.1
    """Angle to the vertical at which it widens below the waist; of trousers and jumpsuits, below the knee [rad]."""
    sleeve: float = 0.18
    """Length of the sleeves along the arm from the shoulder joint; 0: an armhole [m]."""
    sleeve_ease: float = 0.08
    """How much longer the girth of a sleeve is than that of the arm [m]."""
    sleeve_flare: float = 0.0
    """Angle at which a sleeve widens [rad]."""
    strap: float = 0.09
    """Width of the shoulders of sleeveless garments, from the neckline to the armhole [m]."""
    neck_width: float = 0.18
    """Width of the neckline [m]."""
    neck_front: float = 0.09
    """Depth of the neckline in front, below the shoulder beside the neck [m]."""
    neck_back: float = 0.03
    """The same at the back [m]."""
    neckline: Neckline = "round"
    """Shape of the neckline: round, v or square."""
    leg_ease: float = 0.08
    """How much longer the girth of a leg is than that of the body's [m]."""
    leg_taper: float = 0.3
    """How much the legs narrow to the ankle: 0 straight down from the thigh, 1 along the leg."""
    rise: float = 0.02
    """Depth of the crotch below the body's [m]."""
    material: str = "cotton"
    """Name of its material."""


@dataclass(frozen=True)
class Design(Measures):
    """A garment by its kind and its measures.

    Raises:
        BadInput: An unknown kind, neckline or material, or a measure outside its limits.
    """

    kind: Kind
    """What it is: top, dress, skirt, trousers or jumpsuit."""

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
        """Whether it hangs from the shoulders."""
        return self.kind in ("top", "dress", "jumpsuit")

    @property
    def has_legs(self) -> bool:
        """Whether each leg has a tube of its own."""
        return self.kind in ("trousers", "jumpsuit")


def _check_choice(what: str, value: str, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise BadInput(f"unknown {what} of a generated garment", repr(value), f"use one of {', '.join(choices)}")
