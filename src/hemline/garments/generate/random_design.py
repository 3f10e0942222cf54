"""Random designs within the usual range of measures."""

import numpy as np

from .design import NECKLINES, Design, Kind

_SEEDS = {"top": 11, "dress": 22, "skirt": 33, "trousers": 44, "jumpsuit": 55}
_CLOTH = {
    "top": ("cotton", "jersey"),
    "dress": ("cotton", "jersey"),
    "skirt": ("cotton", "wool", "silk"),
    "trousers": ("cotton", "wool", "denim"),
    "jumpsuit": ("cotton", "jersey"),
}

CLOSE_FRACTION = 0.4
"""Fraction of ease and flare that a close-fitting design keeps."""


def plain_design(kind: Kind) -> Design:
    """Returns the usual design of a kind.

    Args:
        kind: top, dress, skirt, trousers or jumpsuit.

    Raises:
        BadInput: An unknown kind.
    """
    lengths = {"top": 0.62, "dress": 1.0, "skirt": 0.55, "trousers": 0.95, "jumpsuit": 1.3}
    flares = {"top": 0.05, "dress": 0.25, "skirt": 0.3}
    return Design(kind, length=lengths.get(kind, 0.6), flare=flares.get(kind, 0.0))


def random_design(kind: Kind, seed: int, *, close: bool = False) -> Design:
    """Returns a random design, visibly different from those of other seeds.

    Args:
        kind: top, dress, skirt, trousers or jumpsuit.
        seed: A number from 0; the same one gives the same design.
        close: Whether the garment fits closely: ease and flare of the same design are multiplied by `CLOSE_FRACTION`.

    Raises:
        BadInput: An unknown kind.
    """
    plain = plain_design(kind)
    random = np.random.default_rng([_SEEDS[kind], seed])

    def draw(low: float, high: float) -> float:
        return round(float(random.uniform(low, high)), 3)

    sleeve = draw(0.08, 0.46) if random.random() < 0.7 else 0.0
    ease = draw(0.04, 0.22)
    neck_width = draw(0.15, 0.22)
    chosen: dict[str, float | str] = {"material": str(random.choice(_CLOTH[kind]))}
    if plain.has_top:
        chosen |= {
            "ease": ease,
            "waist_ease": draw(0.04, ease + 0.08),
            "sleeve": sleeve,
            "sleeve_ease": draw(0.03, 0.12),
            "sleeve_flare": draw(0.0, 0.2),
            "strap": draw(0.05, 0.1),
            "neck_width": neck_width,
            "neck_front": draw(0.05, 0.16),
            "neck_back": draw(0.02, 0.06),
            "neckline": str(random.choice(NECKLINES)),
        }
    if plain.has_legs:
        chosen |= {
            "leg_ease": draw(0.03, 0.18),
            "leg_taper": draw(0.0, 0.9),
            "rise": draw(0.01, 0.05),
            "flare": draw(0.0, 0.12),
        }
    if kind == "top":
        chosen |= {"length": draw(0.48, 0.85), "flare": draw(0.0, 0.3)}
    elif kind == "dress":
        chosen |= {"length": draw(0.85, 1.3), "flare": draw(0.05, 0.5), "waist_height": draw(-0.05, 0.1)}
    elif kind == "skirt":
        chosen |= {"length": draw(0.3, 0.9), "flare": draw(0.0, 0.7), "ease": draw(0.02, 0.15)}
        chosen |= {"waist_height": draw(-0.06, 0.02)}
    elif kind == "trousers":
        chosen |= {"length": draw(0.42, 0.95), "ease": draw(0.02, 0.12), "waist_height": draw(-0.07, 0.02)}
    else:
        chosen |= {"length": draw(0.8, 1.3)}
    if close:
        wide = [name for name in chosen if name.endswith(("ease", "flare"))]
        chosen |= {name: round(CLOSE_FRACTION * float(chosen[name]), 4) for name in wide}
    return Design(kind, **chosen)  # type: ignore[arg-type]
