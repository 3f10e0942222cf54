"""Tries a garment whose unit was guessed in other units, by how it fits the body."""

from typing import TYPE_CHECKING

import numpy as np

from hemline.garments.reading.source import GarmentSource
from hemline.garments.reading.units import other_units

from .alignment import misfit

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

POOR_MISFIT = 3.0
"""Misfit above which a garment is tried in other units: all 49 meshes of the benchmark have less."""

GOOD_MISFIT_RATIO, POOR_MISFIT_RATIO = 0.4, 0.7
"""Another unit is tried if the misfit is below this fraction of that with the guessed unit; the second fraction is for
garments that cannot be worn in the guessed unit."""


def better_unit(source: GarmentSource, shaped: "ShapedBody", least: float, *, poor: bool) -> str | None:
    """Returns the unit in which a garment fits its body far better than in the unit that was guessed; None if none.

    A mesh that has a likely size in metres is in metres, however badly it fits: a small suit in feet, which no limb
    goes through, may fit better. It is tried in other units only if it cannot be worn.

    Args:
        source: The garment's file.
        shaped: The body.
        least: Misfit in the guessed unit.
        poor: Whether the garment is known not to fit in that unit, so that a somewhat better fit counts.
    """
    if source.description.unit is not None or (not poor and (source.unit == "m" or least <= POOR_MISFIT)):
        return None
    cloth = source.cloth
    size = float(np.ptp(cloth.vertices, axis=0).max())
    tried = {}
    for unit in other_units(size, source.unit):
        other = source.in_unit(unit).cloth
        tried[unit] = misfit(other.vertices, other.faces, shaped, source.description.up)
    if not tried:
        return None
    best = min(tried, key=lambda unit: tried[unit])
    limit = POOR_MISFIT_RATIO if poor else GOOD_MISFIT_RATIO
    return best if tried[best] < limit * least and tried[best] <= POOR_MISFIT else None
