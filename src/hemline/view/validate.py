"""What a browser asked for, checked before it is used: a browser can send anything."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from hemline.errors import BadInput

FARTHEST_DRAG = 100.0
"""How far from the middle of the floor a hand may drag the body [m]."""


def check_choice(what: str, value: Any, known: Sequence[str]) -> str:
    """A name out of a list.

    Raises:
        BadInput: It does not stand there.
    """
    if not isinstance(value, str) or value not in known:
        raise BadInput(f"there is no such {what}", _short(value), "choose one of the list")
    return value


def check_switch(what: str, value: Any) -> bool:
    """Yes or no.

    Raises:
        BadInput: It is neither.
    """
    if not isinstance(value, bool):
        raise BadInput(f"{what} is on or off", _short(value), "send true or false")
    return value


def check_number(what: str, value: Any, ends: tuple[float, float]) -> float:
    """A number between two others.

    Raises:
        BadInput: It is none, or lies outside.
    """
    plain = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    if not plain or not ends[0] <= value <= ends[1]:
        raise BadInput(f"{what} lies from {ends[0]:g} to {ends[1]:g}", _short(value), "move the slider")
    return float(value)


def check_numbers(what: str, values: Any, count: int, ends: tuple[float, float]) -> tuple[float, ...]:
    """So many numbers, each between two others.

    Raises:
        BadInput: They are more or fewer, or one is no such number.
    """
    if not isinstance(values, tuple | list) or len(values) != count:
        raise BadInput(f"{what} must be {count} numbers", _short(values), "load the page again")
    return tuple(check_number(what, value, ends) for value in values)


def check_place(value: Any) -> tuple[np.ndarray, np.ndarray]:
    """Where a hand holds the body (3,) [m], and how it is turned there (4,), a unit quaternion wxyz; both float64.

    Raises:
        BadInput: They are no such numbers, or farther away than `FARTHEST_BODY`.
    """
    try:
        at, turn = (np.array(part, np.float64) for part in value)
    except (TypeError, ValueError):
        at = turn = np.zeros(0)
    near = at.shape == (3,) and bool((abs(at) <= FARTHEST_DRAG).all())
    length = float(np.linalg.norm(turn))
    if not near or turn.shape != (4,) or not abs(length - 1) < 0.01:
        raise BadInput("the body cannot be dragged there", _short(value), f"stay within {FARTHEST_DRAG:g} m of the floor")
    return at, turn / length


def _short(value: Any) -> str:
    return repr(value)[:60]
