"""Guesses the unit of a clip from the length of the legs."""

from collections.abc import Mapping

import numpy as np

from hemline.errors import BadMotion

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "inch": 0.0254, "cmu": 0.0254 / 0.45}
"""Known units [m]; `cmu` is the unit of the CMU recordings, 1/0.45 inch."""

METRIC = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 0.001, "inch": 0.0254}
"""Units of characters [m]; MakeHuman uses the decimetre."""

USUAL_LEG = 0.84
"""Length of the leg, hip to knee to ankle, of a person of middle height [m]."""

_LEG_RANGE = (0.3, 1.5)


def unit_of(leg: float, declared: str | None, file: str, *, units: Mapping[str, float] = UNITS) -> tuple[str, str]:
    """Returns the unit of a skeleton, and a sentence that says how it was found.

    Args:
        leg: Length from hip to knee to ankle, in the file's unit.
        declared: Unit that the user names; None: guessed.
        file: Name of the file in error messages.
        units: Possible units [m].

    Raises:
        BadMotion: The declared unit is unknown or contradicts the size, or no unit gives the size of a person.
    """
    if declared is not None and declared not in units:
        raise BadMotion(f"unit of {file} must be one of {', '.join(units)}", f"'{declared}'", "name one of them")
    if not (np.isfinite(leg) and leg > 0):
        raise BadMotion(
            f"the legs of {file} must have a length", leg, "give knees and ankles their distances from the hips"
        )
    guess = min(units, key=lambda unit: abs(np.log(leg * units[unit] / USUAL_LEG)))
    unit = declared or guess
    metres = leg * units[unit]
    if not _LEG_RANGE[0] <= metres <= _LEG_RANGE[1]:
        cure = f"the size fits '{guess}'" if declared else f"scale the file to one of {', '.join(units)}"
        what = f"unit '{unit}' contradicts the size of {file}" if declared else f"{file} has the size of no person"
        raise BadMotion(what, f"legs of {metres:.3g} m", cure)
    how = "as declared" if declared else "guessed from the size"
    return unit, f"unit {unit}, {how}: legs of {leg:.4g} are {metres:.2f} m"
