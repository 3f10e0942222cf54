"""Whether a garment that settled on a body is worn: not inside it, not torn, not tangled, not on the floor."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from hemline.errors import SimulationFailed
from hemline.garments.garment import Garment
from hemline.sim import SimSettings, rest_drape

from .openings import harmless, pierced, unused

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody
    from hemline.datasets.take import Take
from hemline.meshes import edge_strains

TIGHTEST_MEDIAN, TIGHTEST, TORN = 0.10, 0.40, 1.0
"""Strain of the median edge beyond which a garment is too small; of the hundredth, and of any, beyond which it is
torn."""

HOPELESS = 1.5
"""A median strain so many times too large before it settles is not settled at all."""

MOST_CROSSED = 0.5
"""Edges that may go through the garment's own cloth, in percent."""

FARTHEST_FALL = 0.15
"""How far the cloth may sink on average while it settles [m]."""


@dataclass(frozen=True, eq=False)
class Fitness:
    """How a garment is worn.

    Attributes:
        reason: Why it cannot be worn; None: it can.
        figures: `edge_strain_p50`, `edge_strain_p99`, `edge_strain_max`, `residual_share`, `inside`, `pinched`,
            `self_crossing_percent`, `fall_mm`.
        rest: The settled garment; None where it could not be settled.
        warnings: What is odd about it, though it can be worn.
    """

    reason: str | None
    figures: dict[str, float]
    rest: "Take | None"
    warnings: tuple[str, ...] = ()


def fitness(garment: Garment, shaped: "ShapedBody", settings: SimSettings | None = None) -> Fitness:
    """Settle a garment on a body and judge it.

    Args:
        garment: The garment, on this shape or another one of the body.
        shaped: The body.
        settings: Settings of the simulator.
    """
    settings, laid = settings or SimSettings(), garment.dressed(shaped)
    hopeless = _misplaced(laid, shaped, laid.vertices) or _far_too_small(laid)
    if hopeless:
        return Fitness(hopeless, {}, None)
    try:
        rest = rest_drape(garment, shaped, settings)
    except SimulationFailed as failure:
        return Fitness(_why_unsettled(garment, laid, shaped, settings, str(failure)), {}, None)
    vertices = rest.vertices[0]
    fall = float((laid.vertices[:, 1] - vertices[:, 1]).mean())
    kept = (
        "edge_strain_p50",
        "edge_strain_p99",
        "edge_strain_max",
        "residual_share",
        "inside",
        "pinched",
        "self_crossing_percent",
    )
    figures = {key: float(rest.figures[key]) for key in kept} | {"fall_mm": 1000 * fall}
    empty = unused(vertices, garment.faces, shaped)
    warnings = (f"no limb goes through {_openings(empty)}",) if empty else ()
    return Fitness(judged(garment, shaped, vertices, figures), figures, rest, warnings)


def _far_too_small(garment: Garment) -> str | None:
    """Before it settles: whether it is stretched beyond what settling could mend."""
    # cloth that is too wide starts shortened, and unfolds
    strain = np.clip(edge_strains(garment.vertices, garment.faces, garment.rest_edges), 0, None)
    middle, most = np.percentile(strain, [50, 99])
    return _too_small(float(middle), float(most)) if middle > HOPELESS * TIGHTEST_MEDIAN else None


def _too_small(median: float, most: float) -> str:
    return (
        f"it is too small: the median edge is off its length by {100 * median:.0f} %, "
        f"one in a hundred by {100 * most:.0f} %"
    )


def _why_unsettled(garment: Garment, laid: Garment, shaped: "ShapedBody", settings: SimSettings, failure: str) -> str:
    """What falls crumples on the floor, or on nothing: then the fall is the reason, not the crumples."""
    try:
        vertices = rest_drape(garment, shaped, replace(settings, self_contact=False)).vertices[0]
    except SimulationFailed:
        return failure
    return _fallen(1000 * float((laid.vertices[:, 1] - vertices[:, 1]).mean())) or failure


def _fallen(fall_mm: float) -> str | None:
    if fall_mm <= 1000 * FARTHEST_FALL:
        return None
    return f"nothing holds it up: it fell by {fall_mm:.0f} mm and more; name 'pins' in its TOML"


def _misplaced(garment: Garment, shaped: "ShapedBody", vertices: np.ndarray) -> str | None:
    through = pierced(vertices, garment.faces, shaped)
    if through:
        return f"the body goes through its cloth at the {', the '.join(through)}: no opening leads there"
    empty = unused(vertices, garment.faces, shaped)
    if empty and not harmless(vertices, garment.faces, shaped):
        return f"nothing goes through {_openings(empty)}"
    return None


def _openings(empty: tuple[str, ...]) -> str:
    return f"{len(empty)} of its openings, near the {' and the '.join(empty)}"


def judged(garment: Garment, shaped: "ShapedBody", vertices: np.ndarray, figures: dict[str, float]) -> str | None:
    """Why a garment that settled so cannot be worn, by its figures; None: it can."""
    misplaced = _fallen(figures["fall_mm"]) or _misplaced(garment, shaped, vertices)
    if misplaced:
        return misplaced
    if figures["inside"]:
        return f"{figures['inside']:.0f} vertices stay inside the body"
    if figures["edge_strain_p50"] > TIGHTEST_MEDIAN:
        return _too_small(figures["edge_strain_p50"], figures["edge_strain_p99"])
    if figures["edge_strain_p99"] > TIGHTEST:
        most = 100 * figures["edge_strain_p99"]
        return f"it is torn in places: one edge in a hundred is off its length by {most:.0f} % or more"
    if figures["edge_strain_max"] > TORN:
        return f"it is torn: an edge is {1 + figures['edge_strain_max']:.1f} times as long as it should be"
    if figures["self_crossing_percent"] > MOST_CROSSED:
        return f"it is tangled: {figures['self_crossing_percent']:.2f} % of its edges go through its own cloth"
    return None
