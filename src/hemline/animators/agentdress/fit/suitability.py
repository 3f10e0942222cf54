"""Measures and warnings on how well a garment suits AgentDress.

The method moves the garment with the skin under it. It is not meant for garments that hang far from the body, for which
the paper shows poor results (Fig. 13), or for garments that are too tight ("the clothing is a bad fit", section 5).
"""

import warnings
from collections.abc import Mapping

import numpy as np

from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.shape_model import pad_betas
from hemline.datasets import Dataset
from hemline.errors import HemlineWarning

from .anchor_set import AnchorSet

SAME_BETAS = 1e-6
"""Largest difference between betas of the same shape."""
LOOSE_MM = 30.0
"""Mean distance from the skin above which a garment is too loose [mm]."""

STRETCHED_PERCENT = 50.0
"""Stretch of settled edges (99th percentile) above which a garment is too tight."""

PINCHED_PERCENT = 2.0
"""Percentage of pinched vertices in settled garments above which a garment is too tight."""


def fit_quality(dataset: Dataset, anchors: AnchorSet) -> dict[str, float]:
    """Measures whether a garment is too loose or too tight.

    Args:
        dataset: A dataset made by `hemline drape --anchors`.
        anchors: The anchors read from it.

    Returns:
        `skin_distance_mm`: mean distance from the settled garment to the nearest body vertex, over all vertices and
        anchors on the mean shape. If the takes contain them: `stretch_percent`, the 99th percentile of edge stretch,
        and `pinched_percent`, the vertices pinched between two parts of the body; both are medians over the garments
        on one of the shapes of the anchors, the one where the median is largest.
    """
    from scipy.spatial import KDTree

    mean = dataset.body.shaped()
    garments = anchors.rest.mean.reshape(-1, 3) + anchors.offsets[:, 0]
    figures = {"skin_distance_mm": 1e3 * float(KDTree(mean.vertices).query(garments)[0].mean())}
    shapes = pad_betas(anchors.betas, len(dataset.body.shapedirs))
    for name, key, unit in (
        ("stretch_percent", "edge_tension_p99", 100.0),
        ("pinched_percent", "pinched", 100.0 / garments.shape[1]),
    ):
        by_shape: dict[tuple[float, ...], list[float]] = {}
        for row in dataset.anchors():
            of_anchors = (
                np.abs(shapes - pad_betas(np.array([row.betas]), shapes.shape[1])).max(axis=1).min() < SAME_BETAS
            )
            if of_anchors and key in row.figures:
                by_shape.setdefault(row.betas, []).append(row.figures[key])
        if by_shape:
            figures[name] = unit * max(float(np.median(values)) for values in by_shape.values())
    return figures


def warn_of_poor_fit(garment: str, figures: Mapping[str, float], config: AgentDressConfig) -> None:
    """Warns of a garment that is too loose or too tight, and of few anchors, with one line each.

    Args:
        garment: Name of the garment.
        figures: Figures of the fit, including those of `fit_quality`.
        config: Options of the fit.
    """
    expected = f"expect errors of about {figures['error_to_expect_mm']:.0f} mm"
    problems = []
    if figures["skin_distance_mm"] > LOOSE_MM:
        problems.append(
            (
                f"'{garment}' is too loose for AgentDress, which is for garments within {LOOSE_MM:.0f} mm of the skin",
                f"{figures['skin_distance_mm']:.0f} mm on average",
                f"{expected}, and no swing, or fit --animator ropes if most of it hangs",
            )
        )
    if figures.get("stretch_percent", 0.0) > STRETCHED_PERCENT:
        problems.append(
            (
                f"'{garment}' is too tight: on one of the shapes its settled edges are stretched by more than "
                f"{STRETCHED_PERCENT:.0f} %",
                f"{figures['stretch_percent']:.0f} %",
                f"{expected}, or make it larger",
            )
        )
    if figures.get("pinched_percent", 0.0) > PINCHED_PERCENT:
        problems.append(
            (
                f"'{garment}' is pinched between parts of the body, by more than {PINCHED_PERCENT:g} % of its vertices",
                f"{figures['pinched_percent']:.1f} %",
                f"{expected}, or make it larger",
            )
        )
    if figures["shapes"] == 1:
        problems.append(
            (
                f"'{garment}' was settled on one body: on others it follows the skin, without folds of their own",
                "one shape",
                "drape it with --anchors if it is to be played on other bodies",
            )
        )
    if figures["anchors"] < config.neighbours:
        problems.append(
            (
                f"a fit needs at least {config.neighbours} anchors to predict the effect of shapes in other poses",
                f"{figures['anchors']:.0f}",
                f"{expected}, or drape more with 'hemline drape --anchors'",
            )
        )
    for problem in problems:
        warnings.warn(HemlineWarning(*problem), stacklevel=4)
