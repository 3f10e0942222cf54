"""Finds where a posed body overlaps itself, so that no cloth can lie there."""

import numpy as np

from hemline.arrays import Mask
from hemline.bodies.body import PosedBody

from .overlap_kernels import mark_inside
from .parts import closed_parts

_SLABS = 256


def overlapping(posed: PosedBody) -> Mask:
    """Returns a mask of the vertices of a posed body that lie inside another part of it, by winding number.

    Nine parts (torso, upper arms, forearms, thighs, shanks) are closed where they were cut. Near their joint two
    parts always touch, so vertices within one and a half radii of a cut are not tested against the neighbour.

    Args:
        posed: The body.
    """
    vertices = posed.vertices.astype(np.float64)
    parts = closed_parts(posed.shaped.body)
    apexes = [vertices[rim].mean(axis=0) for part in parts for rim in part.rims]
    closed = np.vstack([vertices, *apexes])
    inside = np.zeros(len(vertices), dtype=bool)
    for part in parts:
        mark_inside(closed, part.faces, part.tested, _SLABS, inside)
    return inside
