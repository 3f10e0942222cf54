"""Heights on a body that a design is measured from."""

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
class Lines:
    """Heights in the world of the body's rest pose [m]."""

    shoulder: float
    """Of the shoulder beside the neckline."""
    armpit: float
    """Below which a top has its full width."""
    waist: float
    """Of the narrowest level between hips and chest."""
    crotch: float
    """Where the thighs part."""
    knee: float
    """Of the knees."""
    top: float
    """Of the garment: of its shoulder, or of its waistband."""
    hem: float
    """Of its hem."""


def lines_of(design: Design, shaped: "ShapedBody") -> Lines:
    """Where a garment begins and ends on a body.

    Args:
        design: Its measures.
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
    return Lines(
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
    """The highest level below the pelvis where the left thigh is a centimetre from the middle."""
    left = trunk[(trunk[:, :, 0] > 0).all(axis=1)]
    levels = pelvis - np.arange(0.02, 0.35, _STEP)
    inner = -tapes(left, levels, np.array([np.pi]))[:, 0]
    parted = np.flatnonzero(inner > _STEP)
    return float(levels[parted[0]] if len(parted) else levels[-1])
