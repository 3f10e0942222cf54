"""Girths of a body: level sections of its trunk and legs, as a tape around them would lie."""

from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Float
from hemline.motions.motion import JOINT_NAMES

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

ARMS = ("shoulder", "elbow", "wrist", "hand", "head")
FEET = ("ankle", "foot")


def triangles_of(shaped: "ShapedBody", *, without: tuple[str, ...]) -> Float[np.ndarray, "faces 3 3"]:
    """Returns the corners of the triangles that other joints than the named ones move most, float64 [m].

    Args:
        shaped: The body, at rest.
        without: Endings of the names of joints whose triangles are excluded.
    """
    body = shaped.body
    strongest = body.weight_indices[np.arange(len(body.weights)), body.weights.argmax(axis=1)]
    excluded = [number for number, name in enumerate(JOINT_NAMES) if name.endswith(without)]
    included = ~np.isin(strongest, excluded)
    return np.asarray(shaped.vertices, np.float64)[body.faces[included[body.faces].all(axis=1)]]


def tapes(
    corners: Float[np.ndarray, "faces 3 3"], levels: Float[np.ndarray, " levels"], angles: Float[np.ndarray, " angles"]
) -> Float[np.ndarray, "levels angles"]:
    """Returns the support function of level sections: max over a section's points of x cos a + z sin a.

    Args:
        corners: Triangles [m].
        levels: Heights y of the sections [m].
        angles: Directions a [rad].

    Returns:
        Distance of the tape's tangents from the y axis [m]; -infinity where there is no section.
    """
    start, end = corners.reshape(-1, 3), np.roll(corners, -1, axis=1).reshape(-1, 3)
    directions = np.stack([np.cos(angles), np.sin(angles)])
    result = np.full((len(levels), len(angles)), -np.inf)
    for row, level in enumerate(levels):
        cut = (start[:, 1] < level) != (end[:, 1] < level)
        if cut.any():
            low, high = start[cut], end[cut]
            fraction = (level - low[:, 1]) / (high[:, 1] - low[:, 1])
            points = low + fraction[:, None] * (high - low)
            result[row] = (points[:, [0, 2]] @ directions).max(axis=0)
    return result
