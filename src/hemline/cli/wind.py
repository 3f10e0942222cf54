"""Lets the wind of a command blow on the model that it plays."""

import math
from typing import TypeVar

from hemline.animators import Animator, Wearable, Windy
from hemline.errors import BadInput

Wind = tuple[float, float, float]
"""Velocity of the wind along x, y (up) and z [m/s]."""
CALM: Wind = (0.0, 0.0, 0.0)
Model = TypeVar("Model", bound=Animator | Wearable)


def in_wind(model: Model, wind: Wind) -> Model:
    """Returns the model in a wind; every model plays in calm air.

    Raises:
        BadInput: A component is not finite, or wind does not move the garments of this model.
    """
    got = f"--wind {' '.join(f'{each:g}' for each in wind)}"
    if not all(map(math.isfinite, wind)):
        raise BadInput("--wind must be three finite numbers", got, "give m/s along x, y (up) and z")
    if wind == CALM:
        return model
    if not isinstance(model, Windy):
        cure = "leave it out, name a model of 'ropes' (cape, skirt, knee-dress, robe), or play the garment by 'live'"
        raise BadInput(f"wind does not move garments of {model.name}", got, cure)
    return model.in_wind(wind)
