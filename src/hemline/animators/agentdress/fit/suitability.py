"""How well a garment suits AgentDress: what a fit measures of it, and what it warns of.

The method takes the garment along with the skin under it. It is not for garments that hang far from the body (there
the paper shows poor results, Fig. 13), nor for those that are too tight ("the clothing is a bad fit", section 5).
"""

import warnings
from collections.abc import Mapping

import numpy as np

from hemline import bodies
from hemline.animators.agentdress.config import AgentDressConfig
from hemline.datasets import Dataset
from hemline.errors import HemlineWarning

from .anchor_set import AnchorSet

LOOSE_MM = 30.0
"""Mean distance from the skin beyond which a garment is loose."""

STRETCHED_PERCENT = 50.0
"""Stretch of settled edges (99th percentile) beyond which a garment is tight."""

PINCHED_PERCENT = 2.0
"""Share of pinched vertices in settled garments beyond which it is tight."""


def fit_quality(dataset: Dataset, anchors: AnchorSet) -> dict[str, float]:
    """What tells whether a garment is too loose or too tight.

    Args:
        dataset: What `hemline drape --anchors` made.
        anchors: What was read of it.

    Returns:
        `skin_distance_mm`: from the settled garment to the nearest vertex of the body, mean over all vertices and
        anchors on the mean shape. Where the takes hold them: `stretch_percent`, the 99th percentile of the stretch of
        edges, and `pinched_percent`, vertices that two parts of the body pinch: medians over the anchors on one shape,
        of the shape where it is most.
    """
    from scipy.spatial import KDTree

    mean = bodies.load(dataset.garment.body_name).shaped()
    laid = anchors.rest.mean.reshape(-1, 3) + anchors.offsets[:, 0]
    figures = {"skin_distance_mm": 1e3 * float(KDTree(mean.vertices).query(laid)[0].mean())}
    for name, held, unit in (
        ("stretch_percent", "edge_tension_p99", 100.0),
        ("pinched_percent", "pinched", 100.0 / laid.shape[1]),
    ):
        by_shape: dict[tuple[float, ...], list[float]] = {}
        for row in dataset.anchors():
            if held in row.figures:
                by_shape.setdefault(row.betas, []).append(row.figures[held])
        if by_shape:
            figures[name] = unit * max(float(np.median(each)) for each in by_shape.values())
    return figures


def warn_of_poor_fit(garment: str, figures: Mapping[str, float], config: AgentDressConfig) -> None:
    """Warn, in a line each, of a garment that is too loose or too tight, and of few anchors.

    Args:
        garment: Its name.
        figures: Of the fit, those of `suitability` among them.
        config: Options of the fit.
    """
    expected = f"expect errors of about {figures['error_to_expect_mm']:.0f} mm"
    found = []
    if figures["skin_distance_mm"] > LOOSE_MM:
        found.append(
            (
                f"'{garment}' is too loose for AgentDress, which is for garments within {LOOSE_MM:.0f} mm of the skin",
                f"{figures['skin_distance_mm']:.0f} mm in the mean",
                f"{expected}, and no swing, or fit --animator ropes",
            )
        )
    if figures.get("stretch_percent", 0.0) > STRETCHED_PERCENT:
        found.append(
            (
                f"'{garment}' is too tight: on one of the shapes its settled edges are stretched by more than "
                f"{STRETCHED_PERCENT:.0f} %",
                f"{figures['stretch_percent']:.0f} %",
                f"{expected}, or make it larger",
            )
        )
    if figures.get("pinched_percent", 0.0) > PINCHED_PERCENT:
        found.append(
            (
                f"'{garment}' is pinched between parts of the body, by more than {PINCHED_PERCENT:g} % of its vertices",
                f"{figures['pinched_percent']:.1f} %",
                f"{expected}, or make it larger",
            )
        )
    if figures["anchors"] < config.neighbours:
        found.append(
            (
                f"a fit needs {config.neighbours} anchors and more to tell what shapes do in other poses",
                f"{figures['anchors']:.0f}",
                f"{expected}, or drape more with 'hemline drape --anchors'",
            )
        )
    for each in found:
        warnings.warn(HemlineWarning(*each), stacklevel=4)
