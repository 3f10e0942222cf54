"""How far from the bodies and poses of its fit AgentDress is believed."""

import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np

from hemline.arrays import Betas, Float
from hemline.bodies.shape import LARGEST_BETA
from hemline.errors import BadModel, HemlineWarning
from hemline.files.contents import AGAIN
from hemline.garments.material import Material

from .materials import Materials

BetaRange = tuple[float, float]
"""The lowest and the highest beta."""

DEFAULT_BETA_RANGE: BetaRange = (-2.0, 2.0)
"""Of the anchors that `hemline drape --anchors` makes."""

RANGE_FACTOR = 1.5
"""How far the shape model is believed: to so many times the betas of the fit."""

NOVELTY_LIMIT = 0.8
"""Poses left out of a fit whose novelty is above it are missed by about three times as much as the mean, and more."""


def reliable_range(fitted: BetaRange) -> BetaRange:
    """The range in which a model is believed that was fitted on betas of a smaller one."""
    return RANGE_FACTOR * fitted[0], RANGE_FACTOR * fitted[1]


def warn_of_extreme_betas(garment: str, fitted: BetaRange, betas: Betas) -> None:
    """Warn of betas beyond the range that is believed."""
    low, high = reliable_range(fitted)
    if not ((betas >= low) & (betas <= high)).all():
        warnings.warn(
            HemlineWarning(
                f"the model of '{garment}' was fitted on betas from {fitted[0]:g} to {fitted[1]:g}, and errs more and "
                f"more below {low:g} and above {high:g}",
                " ".join(f"{beta:g}" for beta in np.trim_zeros(betas, "b")),
                "choose betas nearer to 0, or --clamp-betas",
            ),
            stacklevel=3,
        )


def warn_of_unknown_material(garment: str, materials: Materials, material: Material) -> None:
    """Warn of a material that lies outside of all those of the fit."""
    if materials.is_outside(material):
        names = ", ".join((materials.own.name, *materials.known))
        what = f"the model of '{garment}' was fitted on {names}; what is stiffer, limper or smoother it has to guess"
        warnings.warn(HemlineWarning(what, material.name, "drape it in that material, too"), stacklevel=3)


def read_beta_range(held: Mapping[str, Any]) -> BetaRange:
    """The betas of the fit, from the metadata of a model file; earlier files lack them.

    Raises:
        BadModel: They are no range.
    """
    betas = held.get("betas", list(DEFAULT_BETA_RANGE))
    numbers = isinstance(betas, list) and len(betas) == 2 and all(isinstance(beta, float | int) for beta in betas)
    if not (numbers and -LARGEST_BETA <= betas[0] <= betas[1] <= LARGEST_BETA):
        raise BadModel("a model names the lowest and the highest beta of its fit", betas, AGAIN)
    return float(betas[0]), float(betas[1])


def novelty(distances: Float[np.ndarray, "regions poses"] | None, shares: Float[np.ndarray, " regions"]) -> float:
    r"""$\sqrt{\sum_g \bar r_g \min_s D_g^s}$: how far a pose is from the nearest one of the fit, over regions.

    Args:
        distances: To each pose of the fit, squared; 1 is their median between anchors. None: there is no pose yet.
        shares: How much of the garment each region is.

    Returns:
        The distance; 1: as far as anchors are apart in the median. NaN without a pose.
    """
    return float("nan") if distances is None else float(np.sqrt(shares @ distances.min(axis=1)))
