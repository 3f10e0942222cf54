"""Whether chains on lines from the rim to the hem suit a garment."""

from typing import TYPE_CHECKING

import numpy as np

from hemline.animators.ropes.bones.chains import Ropes
from hemline.meshes import geodesic_distances

from .scattered import suspension_by_piece

if TYPE_CHECKING:
    from hemline.garments.garment import Garment

_UPWARD_LIMIT = 1 / 3
"""Fraction of the chains that may end above their roots."""
_JUMP_RATIO, _JUMP, _JUMPS_LIMIT = 1.25, 0.01, 0.02
"""A chain jumps where its bones are farther apart than their distance along the cloth, by that ratio and length [m];
at most that fraction of the bones may."""
_FAR_SPACINGS, _BARE_LIMIT = 3.0, 0.1
"""Distance from all bones, over their mean spacing, beyond which at most that fraction of the cloth may lie."""


def layout_fault(garment: "Garment", ropes: Ropes) -> str | None:
    """Says why chains on geodesic lines do not suit a garment: they end above their roots, jump, or miss much of it.

    A line from the neck that runs into a sleeve has the same place on the rim, and the same distance from it, as a line
    down the side. Where sleeves branch off, chains along geodesics jump between the two.

    Args:
        garment: The garment.
        ropes: Its ropes.

    Returns:
        The reason; None if they suit it.
    """
    offsets = ropes.chains.offsets
    upward = int((ropes.rest[offsets[1:] - 1, 1] >= ropes.rest[offsets[:-1], 1]).sum())
    if upward > _UPWARD_LIMIT * (len(offsets) - 1):
        return f"{upward} of {len(offsets) - 1} chains end above their roots"
    depth = geodesic_distances(
        garment.vertices, garment.faces, suspension_by_piece(garment), rest_edges=garment.rest_edges
    )
    depths = (depth[ropes.embedding.corners] * ropes.embedding.barycentric).sum(axis=1)
    free = np.flatnonzero(ropes.parents >= 0)
    jumps = int((ropes.chains.rest_spans[free] > _JUMP_RATIO * np.abs(depths[free] - depths[free - 1]) + _JUMP).sum())
    if jumps > _JUMPS_LIMIT * len(free):
        return f"at {jumps} of {len(free)} bones a chain jumps to other cloth"
    bones = ropes.embedding.corners[np.arange(ropes.node_count), ropes.embedding.barycentric.argmax(axis=1)]
    away = geodesic_distances(garment.vertices, garment.faces, bones, rest_edges=garment.rest_edges)
    areas = np.abs(np.linalg.det(garment.rest_edges)) / 2
    spacing = np.sqrt(areas.sum() / ropes.node_count)
    bare = float(areas[away[garment.faces].mean(axis=1) > _FAR_SPACINGS * spacing].sum() / areas.sum())
    if bare > _BARE_LIMIT:
        return f"{100 * bare:.0f} % of the cloth is farther than {_FAR_SPACINGS * spacing:.2f} m from all bones"
    return None
