"""The air in which the takes of a fit were simulated."""

import math
import warnings

from hemline.animators.ropes.mechanics.constants import AIR_DENSITY
from hemline.datasets.take import take_metadata
from hemline.errors import HemlineWarning

from .gather import TakeFrames


def air_density_of(source: TakeFrames) -> float:
    """Returns the density of the air in which most frames of the takes to train on were simulated [kg/m^3].

    Warns:
        HemlineWarning: A take does not say in which air it was simulated, and counts as made in air of `AIR_DENSITY`;
            or takes were simulated in air of several densities.
    """
    frames: dict[float, int] = {}
    silent = []
    for row, side in zip(source.rows, source.sides, strict=True):
        if side:
            continue
        settings = take_metadata(source.dataset.path(row.name))["inputs"].get("settings")
        density = settings.get("air_density") if isinstance(settings, dict) else None
        if not isinstance(density, int | float) or not math.isfinite(density) or density < 0:
            silent.append(row.name)
            density = AIR_DENSITY
        frames[float(density)] = frames.get(float(density), 0) + row.clip_frames
    name = source.dataset.garment.name
    if silent:
        what, got = f"takes of '{name}' do not say in which air they were simulated", f"{len(silent)} such takes"
        cure = f"air of {AIR_DENSITY:g} kg/m^3 is assumed; simulate them with 'hemline simulate' if it was another"
        warnings.warn(HemlineWarning(what, got, cure), stacklevel=3)
    if len(frames) > 1:
        got = ", ".join(f"{count} frames at {density:g} kg/m^3" for density, count in sorted(frames.items()))
        what, cure = f"takes of '{name}' were simulated in different air", "the ropes get that of most frames"
        warnings.warn(HemlineWarning(what, got, cure), stacklevel=3)
    return max(frames, key=lambda density: frames[density])
