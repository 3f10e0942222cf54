"""Settles a garment on a body and decides whether it can be worn: not inside the body, torn, tangled or fallen."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from hemline.errors import SimulationFailed
from hemline.garments.garment import Garment
from hemline.meshes import edge_strains
from hemline.sim import SimSettings, rest_drape
from hemline.sim.rest.settle import rest_state
from hemline.sim.rest.tangles import MOST_CROSSING_WORN, TangledCloth

from .openings import empty_openings, is_worn_nowhere, joints_through_cloth, openings_are_harmless

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody
    from hemline.datasets.take import Take

MEDIAN_STRAIN_LIMIT = 0.10
"""Strain of the median edge above which a garment is too small."""

P99_STRAIN_LIMIT = 0.40
"""Strain of the 99th percentile of edges above which a garment is torn in places."""

STRAIN_LIMIT = 1.0
"""Strain of any edge above which a garment is torn."""

HOPELESS_RATIO = 1.5
"""A garment whose median strain exceeds the limit by this factor before it settles is rejected without settling."""

CROSSING_LIMIT = 100 * MOST_CROSSING_WORN
"""Largest percentage of edges that may go through the garment's own cloth."""

TANGLED_FROM = 0.5
"""Percentage of such edges from which a garment is called tangled, which does not prevent it from being worn."""

FALL_LIMIT = 0.15
"""Largest distance that the cloth may sink on average while it settles [m]."""


@dataclass(frozen=True, eq=False)
class Fitness:
    """How well a garment fits on a body.

    Attributes:
        reason: Reason why it cannot be worn; None if it can.
        figures: `edge_strain_p50`, `edge_strain_p99`, `edge_strain_max`, `residual_share`, `inside`, `pinched`,
            `self_crossing_percent`, `fall_mm`.
        rest: The settled garment; None if it could not be settled.
        warnings: Oddities that do not prevent it from being worn.
        tangled: Whether it settles so that it goes through itself in more than a few places.
    """

    reason: str | None
    figures: dict[str, float]
    rest: "Take | None"
    warnings: tuple[str, ...] = ()
    tangled: bool = False


def fitness(
    garment: Garment,
    shaped: "ShapedBody",
    settings: SimSettings | None = None,
    *,
    on_step: Callable[[], None] | None = None,
) -> Fitness:
    """Settles a garment on a body and decides whether it can be worn.

    Args:
        garment: The garment, on this shape or another one of the body.
        shaped: The body.
        settings: Settings of the simulator.
        on_step: Called before each step of the simulator; what it raises ends the search.
    """
    settings, start = settings or SimSettings(), garment.dressed(shaped)
    hopeless = _placement_fault(start, shaped, start.vertices) or _far_too_small(start)
    if hopeless:
        return Fitness(hopeless, {}, None)
    try:
        rest = _settle(garment, shaped, settings, on_step)
    except SimulationFailed as failure:
        reason = _why_unsettled(garment, start, shaped, settings, failure, on_step)
        return Fitness(reason, {}, None, tangled=isinstance(failure, TangledCloth))
    vertices = rest.vertices[0]
    fall = float((start.vertices[:, 1] - vertices[:, 1]).mean())
    keys = (
        "edge_strain_p50",
        "edge_strain_p99",
        "edge_strain_max",
        "residual_share",
        "inside",
        "pinched",
        "self_crossing_percent",
    )
    figures = {key: float(rest.figures[key]) for key in keys} | {"fall_mm": 1000 * fall}
    empty = empty_openings(vertices, garment.faces, shaped)
    warnings = (f"no limb goes through {_openings(empty)}",) if empty else ()
    crossing = figures["self_crossing_percent"]
    if tangled := crossing > TANGLED_FROM:
        what = f"{crossing:.2f} % of its edges go through its own cloth"
        warnings += (f"{what}: make and animate simulate it without contact of the cloth with itself",)
    return Fitness(unwearable_reason(garment, shaped, vertices, figures), figures, rest, warnings, tangled)


def _settle(
    garment: Garment, shaped: "ShapedBody", settings: SimSettings, on_step: Callable[[], None] | None
) -> "Take":
    """Settles a garment; one that is tangled settles as it is, if it is not too bad.

    Raises:
        SimulationFailed: It does not settle, or is too tangled.
    """
    try:
        return rest_drape(garment, shaped, settings, on_step=on_step)
    except TangledCloth as failure:
        try:
            return rest_state(garment, shaped, settings, max_crossing=MOST_CROSSING_WORN, on_step=on_step).take()
        except TangledCloth:
            raise failure from None


def _far_too_small(garment: Garment) -> str | None:
    """Returns a reason if the garment is stretched, before it settles, beyond what settling could mend."""
    # cloth that is too wide starts shortened, and unfolds
    strain = np.clip(edge_strains(garment.vertices, garment.faces, garment.rest_edges), 0, None)
    median, high = np.percentile(strain, [50, 99])
    return _too_small(float(median), float(high)) if median > HOPELESS_RATIO * MEDIAN_STRAIN_LIMIT else None


def _too_small(median: float, high: float) -> str:
    return (
        f"it is too small: the median edge is off its length by {100 * median:.0f} %, "
        f"one in a hundred by {100 * high:.0f} %"
    )


def _why_unsettled(
    garment: Garment,
    start: Garment,
    shaped: "ShapedBody",
    settings: SimSettings,
    failure: SimulationFailed,
    on_step: Callable[[], None] | None,
) -> str:
    """Returns why a garment could not settle: its fall, if it falls and crumples, else the failure of the simulator."""
    vertices = failure.vertices if isinstance(failure, TangledCloth) else None
    if vertices is None:
        try:
            loose = replace(settings, self_contact=False)
            vertices = rest_drape(garment, shaped, loose, on_step=on_step).vertices[0]
        except SimulationFailed:
            return str(failure)
    return _fall_fault(1000 * float((start.vertices[:, 1] - vertices[:, 1]).mean())) or str(failure)


def _fall_fault(fall_mm: float) -> str | None:
    if fall_mm <= 1000 * FALL_LIMIT:
        return None
    return f"nothing holds it up: it fell by {fall_mm:.0f} mm and more; name 'pins' in its TOML"


def _placement_fault(garment: Garment, shaped: "ShapedBody", vertices: np.ndarray) -> str | None:
    through = joints_through_cloth(vertices, garment.faces, shaped)
    if through:
        return f"the body goes through its cloth at the {', the '.join(through)}: no opening leads there"
    if is_worn_nowhere(vertices, garment.faces, shaped):
        return "nothing goes through any of its openings: it lies beside the body"
    empty = empty_openings(vertices, garment.faces, shaped)
    if empty and not openings_are_harmless(vertices, garment.faces, shaped):
        return f"nothing goes through {_openings(empty)}"
    return None


def _openings(empty: tuple[str, ...]) -> str:
    return f"{len(empty)} of its openings, near the {' and the '.join(empty)}"


def unwearable_reason(
    garment: Garment, shaped: "ShapedBody", vertices: np.ndarray, figures: dict[str, float]
) -> str | None:
    """Returns the reason why a settled garment cannot be worn, by its figures; None if it can."""
    misplaced = _fall_fault(figures["fall_mm"]) or _placement_fault(garment, shaped, vertices)
    if misplaced:
        return misplaced
    if figures["inside"]:
        return f"{figures['inside']:.0f} vertices stay inside the body"
    if figures["edge_strain_p50"] > MEDIAN_STRAIN_LIMIT:
        return _too_small(figures["edge_strain_p50"], figures["edge_strain_p99"])
    if figures["edge_strain_p99"] > P99_STRAIN_LIMIT:
        most = 100 * figures["edge_strain_p99"]
        return f"it is torn in places: one edge in a hundred is off its length by {most:.0f} % or more"
    if figures["edge_strain_max"] > STRAIN_LIMIT:
        return f"it is torn: an edge is {1 + figures['edge_strain_max']:.1f} times as long as it should be"
    if figures["self_crossing_percent"] > CROSSING_LIMIT:
        return f"it is tangled: {figures['self_crossing_percent']:.2f} % of its edges go through its own cloth"
    return None
