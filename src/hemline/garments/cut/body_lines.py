"""Lines on a body that garments hang from: its joints, lines laid on its skin, points along a line."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Float, Points
from hemline.meshes import ClosestTree
from hemline.motions.motion import JOINT_NAMES

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

_ROUNDS = 4
_MOST = 2.5
"""Heights above the skin at which a line may bridge a furrow, at most."""


def joint(shaped: "ShapedBody", name: str) -> Float[np.ndarray, "3"]:
    """Position of a joint at rest, float64 [m]."""
    return np.asarray(shaped.joints[JOINT_NAMES.index(name)], np.float64)


def fit_to_skin(line: Points, tree: ClosestTree, height: float, smooth: Callable[[Points], Points]) -> Points:
    """A line smoothed and laid on the skin by turns.

    Args:
        line: Points of it [m].
        tree: The body's surface at rest.
        height: Height above the skin; up to 2.5 times as much where the line bridges a furrow [m].
        smooth: What makes it smooth, its open ends or its closing in mind.

    Returns:
        Points [m], float64.
    """
    for _ in range(_ROUNDS):
        line = smooth(line)
        closest = tree.closest(line)
        outward = tree.outward(closest)
        above = np.clip(((line - closest.positions) * outward).sum(axis=1), height, _MOST * height)
        line = closest.positions + above[:, None] * outward
    return line


def interpolate_along(line: np.ndarray, values: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Values at shares of a polyline's length."""
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    return np.stack([np.interp(share * length[-1], length, values[:, axis]) for axis in range(3)], axis=1)


def lengths(lines: Float[np.ndarray, "lines points 3"]) -> Float[np.ndarray, " lines"]:
    """Length of each polyline [m]."""
    return np.linalg.norm(np.diff(lines, axis=1), axis=2).sum(axis=1)
