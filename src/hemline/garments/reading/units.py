"""Unit and up axis of a garment's file, as declared or guessed."""

import numpy as np

from hemline.arrays import Vertices
from hemline.errors import BadGarment

UNITS = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
"""Units by name, in metres."""

UNIT_NAMES = {"in": "inches", "ft": "feet"}
"""Units whose short names are words, in full."""

AXES = ("y", "z")
"""Axes that may point up; the first is hemline's own."""

UP_GUESS_RATIO = 0.67
"""z is taken to point up where the garment then misfits the body by less than this fraction of its misfit with y up."""

Z_UP_NOTE = "up: z, as it fits the body so; it was turned to y up"
"""Note of a garment whose up axis was guessed to be z."""

_GUESSED = ("m", "dm", "cm", "mm")
_SMALLEST, _LARGEST = 0.1, 3.0


def unit_of(vertices: Vertices, declared: str | None, name: str) -> tuple[str, tuple[str, ...]]:
    """Returns the unit of a garment's file: the declared one, or a guess, since garments are 0.22 to 2.2 m long.

    Args:
        vertices: Positions in the file's unit.
        declared: A name of `UNITS`, or None to guess.
        name: Name of the file in error messages.

    Returns:
        The name of the unit, and a note if it was guessed.

    Raises:
        BadGarment: Unknown unit, a declared one that makes the garment smaller than 0.1 m or larger than 3 m, or a
            size that no unit explains.
    """
    size = float(np.ptp(vertices, axis=0).max())
    fitting = [unit for unit in _GUESSED if 0.22 <= size * UNITS[unit] < 2.2]
    cure = f"in {fitting[0]} it would be {size * UNITS[fitting[0]]:.3g} m" if fitting else "scale the mesh"
    if declared is None:
        if not fitting:
            raise BadGarment(
                f"{name} has a size that no unit explains", f"{size:.4g} units long", "declare its unit, or scale it"
            )
        unit = fitting[0]
        if unit == "m":
            return unit, ()
        return unit, (f"unit: {size:.4g} units long, so they are {unit} and were converted to metres",)
    if declared not in UNITS:
        raise BadGarment(f"{name}: unknown unit", f"'{declared}'", f"use one of {', '.join(UNITS)}")
    if not _SMALLEST <= size * UNITS[declared] <= _LARGEST:
        got = f"{size * UNITS[declared]:.4g} m long"
        raise BadGarment(f"{name}: the declared unit '{declared}' contradicts the size", got, f"{cure}; correct 'unit'")
    return declared, ()


def other_units(size: float, unit: str) -> tuple[str, ...]:
    """Returns the units, other than the one that was guessed, in which a garment has a likely size, 0.25 to 2.2 m.

    Args:
        size: Size of the garment in the unit that was guessed [m].
        unit: That unit.
    """
    raw = size / UNITS[unit]
    return tuple(each for each in UNITS if each != unit and 0.25 <= raw * UNITS[each] < 2.2)


def to_y_up(vertices: Vertices, up: str) -> Vertices:
    """Turns positions so that y points up.

    Args:
        vertices: Positions whose axis `up` points up. With z up, the front faces -y, as in Blender.
        up: One of `AXES`.
    """
    return np.ascontiguousarray(vertices[:, [0, 2, 1]] * (1, 1, -1)) if up == "z" else vertices
