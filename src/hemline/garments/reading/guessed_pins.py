"""Guesses what is pinned of a garment whose file does not say: nothing that the shoulders carry, else upper rims."""

from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Faces, Vertices
from hemline.garments.pin_rules import PinRule
from hemline.garments.shoulders import carried_by_shoulders
from hemline.garments.upper_rim import upper_rim
from hemline.meshes import components

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

_PART_VERTICES = 0.02
"""Parts with less than this fraction of the vertices are not looked at one by one."""


def guess_pins(vertices: Vertices, faces: Faces, body: "ShapedBody") -> tuple[PinRule, tuple[str, ...]]:
    """Guesses the pins of a garment on a body, part by part, so that trousers under a shirt get some of their own.

    Args:
        vertices: The garment on the body at rest [m].
        faces: Triangles.
        body: The body.

    Returns:
        A rule for `bind_pins`, and a note on parts that were looked at.
    """
    part = components(faces, len(vertices))
    counts = np.bincount(part)
    large = np.flatnonzero(counts >= max(_PART_VERTICES * len(vertices), 3))
    if len(large) < 2 or (carried_by_shoulders(vertices, faces, body) and not _apart(vertices, part, large)):
        if carried_by_shoulders(vertices, faces, body):
            return "none", ("pins: none, as the shoulders carry it",)
        return None, ()
    pinned, carried = [], 0
    for each in large:
        ids = np.flatnonzero(part == each)
        own = np.searchsorted(ids, faces[part[faces[:, 0]] == each]).astype(np.int32)
        if carried_by_shoulders(vertices[ids], own, body):
            carried += 1
        else:
            pinned.append(ids[upper_rim(vertices[ids], own)])
    ids = np.concatenate([np.empty(0, np.int64), *pinned])
    if not len(ids):
        return "none", ("pins: none, as the shoulders carry it",)
    note = f"pins: the highest rim of each of {len(pinned)} parts, {len(ids)} vertices"
    if carried:
        note += f"; none of the {carried} that the shoulders carry"
    return tuple(ids.tolist()), (note,)


def _apart(vertices: Vertices, part: np.ndarray, large: np.ndarray) -> bool:
    """Whether some large part lies wholly below the tops of others by more than half of its height."""
    tops = np.array([vertices[part == each, 1].max() for each in large])
    heights = np.array([np.ptp(vertices[part == each, 1]) for each in large])
    return bool((tops.max() - tops > 0.5 * np.maximum(heights, 0.1)).any())
