"""Heights on a body from which a design is measured."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hemline.garments.cut.body_lines import joint

from .design import Design
from .tapes import ARMS, tapes, triangles_of

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

_STEP = 0.01


@dataclass(frozen=True)
class BodyLines:
    """Heights in the world of the body's rest pose [m]."""

    shoulder: float
    """Height of the shoulder beside the neckline."""
    armpit: float
    """Height below which a top has its full width."""
    waist: float
    """Height of the narrowest level between hips and chest."""
    crotch: float
    """Height at which the thighs part."""
    knee: float
    """Height of the knees."""
    top: float
    """Height of the top of the garment: its shoulder or its waistband."""
    hem: float
    """Height of the hem of the garment."""


def lines_of(design: Design, shaped: "ShapedBody") -> BodyLines:
    """Measures the heights of a body and of a garment on it.

    Args:
        design: Kind and measures of the garment.
        shaped: The body.
    """
    trunk = triangles_of(shaped, without=ARMS)
    pelvis, chest, neck = (joint(shaped, name)[1] for name in ("pelvis", "spine3", "neck"))
    levels = np.arange(pelvis + 0.05, chest, _STEP)
    half = np.linspace(-np.pi / 2, np.pi / 2, 19)
    waist = float(levels[tapes(trunk, levels, half).sum(axis=1).argmin()])
    upper = np.arange(joint(shaped, "left_shoulder")[1], neck + 0.05, _STEP / 2)
    width = tapes(trunk, upper, np.zeros(1))[:, 0]
    shoulder = float(upper[np.flatnonzero(width >= design.neck_width / 2)[-1]])
    top = shoulder if design.has_top else waist + design.waist_height
    return BodyLines(
        shoulder=shoulder,
        armpit=float(joint(shaped, "left_shoulder")[1] - _ARMPIT),
        waist=waist,
        crotch=_crotch(trunk, pelvis),
        knee=float(joint(shaped, "left_knee")[1]),
        top=top,
        hem=top - design.length,
    )


_ARMPIT = 0.11


def _crotch(trunk: np.ndarray, pelvis: float) -> float:
    """Returns the highest level below the pelvis at which the left thigh is a centimetre from the middle."""
    left = trunk[(trunk[:, :, 0] > 0).all(axis=1)]
    levels = pelvis - np.arange(0.02, 0.35, _STEP)
    inner = -tapes(left, levels, np.array([np.pi]))[:, 0]
    parted = np.flatnonzero(inner > _STEP)
    return float(levels[parted[0]] if len(parted) else levels[-1])
