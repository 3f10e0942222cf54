"""Checks of the values that a browser sends, which can be anything."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from hemline.errors import BadInput

FARTHEST_DRAG = 100.0
"""Longest distance from the middle of the floor to which the body can be dragged [m]."""


def check_choice(what: str, value: Any, known: Sequence[str]) -> str:
    """Checks a name that must be in a list.

    Raises:
        BadInput: It is not in the list.
    """
    if not isinstance(value, str) or value not in known:
        raise BadInput(f"there is no such {what}", _short(value), "choose one of the list")
    return value


def check_switch(what: str, value: Any) -> bool:
    """Checks a value that must be true or false.

    Raises:
        BadInput: It is neither.
    """
    if not isinstance(value, bool):
        raise BadInput(f"{what} is on or off", _short(value), "send true or false")
    return value


def check_number(what: str, value: Any, ends: tuple[float, float]) -> float:
    """Checks a number that must lie between two others.

    Raises:
        BadInput: It is no number, or lies outside.
    """
    plain = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    if not plain or not ends[0] <= value <= ends[1]:
        raise BadInput(f"{what} lies from {ends[0]:g} to {ends[1]:g}", _short(value), "move the slider")
    return float(value)


def check_numbers(what: str, values: Any, count: int, ends: tuple[float, float]) -> tuple[float, ...]:
    """Checks a given number of numbers, each of which must lie between two others.

    Raises:
        BadInput: There are more or fewer, or one of them is no such number.
    """
    if not isinstance(values, tuple | list) or len(values) != count:
        raise BadInput(f"{what} must be {count} numbers", _short(values), "load the page again")
    return tuple(check_number(what, value, ends) for value in values)


def check_place(value: Any) -> tuple[np.ndarray, np.ndarray]:
    """Checks a place to which the body is dragged.

    Returns:
        The position (3,) [m] and the rotation (4,), a unit quaternion wxyz; both float64.

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
        raise BadInput(
            "the body cannot be dragged there", _short(value), f"stay within {FARTHEST_DRAG:g} m of the floor"
        )
    return at, turn / length


def _short(value: Any) -> str:
    return repr(value)[:60]
