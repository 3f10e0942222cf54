"""The range of bodies, poses and materials in which AgentDress is reliable."""

import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np

from hemline.arrays import Betas, Float
from hemline.bodies.lifted_arms import FORMER_LIFT_DEG
from hemline.bodies.shape import LARGEST_BETA
from hemline.errors import BadModel, HemlineWarning
from hemline.files.contents import AGAIN
from hemline.garments.material import Material

from .materials import Materials

BetaRange = tuple[float, float]
"""The lowest and the highest beta."""

DEFAULT_BETA_RANGE: BetaRange = (-2.0, 2.0)
"""Range of the betas of the anchors that `hemline drape --anchors` makes."""

DEFAULT_STRETCH_LIMIT = 1.15
"""Stretch limit of models whose file does not name one."""
LEAST_STRETCH_LIMIT, MOST_STRETCH_LIMIT = 1.06, 1.15
"""Smallest and largest stretch limit: below, every frame would need correction; above, the cloth looks torn."""

MOST_LIFT_DEG = 45.0
"""Largest angle by which a model may lift hanging arms [deg]."""

RANGE_FACTOR = 1.5
"""Ratio of the range in which the shape model is reliable to the range of the fit."""

NOVELTY_LIMIT = 0.8
"""Novelty above which the error is about three times the mean or more, on poses left out of a fit."""


def reliable_range(fitted: BetaRange) -> BetaRange:
    """Returns the range of betas in which a model is reliable, given the range of its fit."""
    return RANGE_FACTOR * fitted[0], RANGE_FACTOR * fitted[1]


def warn_of_extreme_betas(garment: str, fitted: BetaRange, betas: Betas) -> None:
    """Warns of betas beyond the reliable range, or of any if the garment was fitted on the mean body alone."""
    low, high = reliable_range(fitted)
    if low == high:
        if np.any(betas):
            what = f"the model of '{garment}' was fitted on one body, and follows the skin of others without new folds"
            cure = "fit it to drapes on bodies of many shapes (hemline drape --anchors)"
            got = " ".join(f"{beta:g}" for beta in np.trim_zeros(betas, "b"))
            warnings.warn(HemlineWarning(what, f"betas {got}", cure), stacklevel=3)
        return
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
    """Warns of a material that lies outside the range of those of the fit."""
    if materials.is_outside(material):
        names = ", ".join((materials.own.name, *materials.known))
        what = f"the model of '{garment}' was fitted on {names}; what is stiffer, limper or smoother it has to guess"
        warnings.warn(HemlineWarning(what, material.name, "drape it in that material, too"), stacklevel=3)


def read_stretch_limit(metadata: Mapping[str, Any]) -> float:
    """Reads the stretch limit from the metadata of a model file; the default one if it is missing.

    Raises:
        BadModel: It is no number from 1 to 2.
    """
    found = metadata.get("stretch_limit", DEFAULT_STRETCH_LIMIT)
    if not isinstance(found, float) or not 1 <= found <= 2:
        raise BadModel("the stretch limit of a model is a number from 1 to 2", found, AGAIN)
    return found


def read_lift(metadata: Mapping[str, Any]) -> float:
    """Reads the angle by which hanging arms were lifted from the metadata of a model file; the former one if missing.

    Raises:
        BadModel: It is no angle from 0 to 45 degrees.
    """
    found = metadata.get("lift_deg", FORMER_LIFT_DEG)
    if not isinstance(found, float) or not 0 <= found <= MOST_LIFT_DEG:
        raise BadModel("the arms of a model are lifted by 0 to 45 degrees", found, AGAIN)
    return found


def read_beta_range(metadata: Mapping[str, Any]) -> BetaRange:
    """Reads the beta range of the fit from the metadata of a model file; the default range if it is missing.

    Raises:
        BadModel: The entry is not a range.
    """
    betas = metadata.get("betas", list(DEFAULT_BETA_RANGE))
    numbers = isinstance(betas, list) and len(betas) == 2 and all(isinstance(beta, float | int) for beta in betas)
    if not (numbers and -LARGEST_BETA <= betas[0] <= betas[1] <= LARGEST_BETA):
        raise BadModel("a model names the lowest and the highest beta of its fit", betas, AGAIN)
    return float(betas[0]), float(betas[1])


def novelty(distances: Float[np.ndarray, "regions poses"] | None, sizes: Float[np.ndarray, " regions"]) -> float:
    r"""Returns $\sqrt{\sum_g \bar r_g \min_s D_g^s}$, the distance of a pose from the nearest pose of the fit.

    Args:
        distances: Squared distance to each pose of the fit, 1 being the median between anchors. None: no pose yet.
        sizes: Fraction of the garment in each region.

    Returns:
        The distance, 1 being the median distance between anchors. NaN without a pose.
    """
    return float("nan") if distances is None else float(np.sqrt(sizes @ distances.min(axis=1)))
