"""Joints of a body, and lines on its skin that garments hang from."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Float, Points
from hemline.meshes import ClosestTree
from hemline.motions.motion import JOINT_NAMES

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

_ROUNDS = 4
_MOST_HEIGHTS = 2.5
"""Greatest height at which a line may bridge a furrow, as a multiple of its height above the skin."""


def joint(shaped: "ShapedBody", name: str) -> Float[np.ndarray, "3"]:
    """Returns the position of a joint at rest, float64 [m]."""
    return np.asarray(shaped.joints[JOINT_NAMES.index(name)], np.float64)


def fit_to_skin(line: Points, tree: ClosestTree, height: float, smooth: Callable[[Points], Points]) -> Points:
    """Fits a line to the skin: it is smoothed and projected onto the skin by turns.

    Args:
        line: Points of the line [m].
        tree: Surface of the body at rest.
        height: Height above the skin; up to 2.5 times as much where the line bridges a furrow [m].
        smooth: Smooths a line, which knows whether it is open or closed.

    Returns:
        Points [m], float64.
    """
    for _ in range(_ROUNDS):
        line = smooth(line)
        closest = tree.closest(line)
        outward = tree.outward(closest)
        above = np.clip(((line - closest.positions) * outward).sum(axis=1), height, _MOST_HEIGHTS * height)
        line = closest.positions + above[:, None] * outward
    return line


def interpolate_along(line: np.ndarray, values: np.ndarray, fractions: np.ndarray) -> np.ndarray:
    """Interpolates values that are given at the points of a polyline, at fractions of its length."""
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    return np.stack([np.interp(fractions * length[-1], length, values[:, axis]) for axis in range(3)], axis=1)


def lengths(lines: Float[np.ndarray, "lines points 3"]) -> Float[np.ndarray, " lines"]:
    """Returns the length of each polyline [m]."""
    return np.linalg.norm(np.diff(lines, axis=1), axis=2).sum(axis=1)
