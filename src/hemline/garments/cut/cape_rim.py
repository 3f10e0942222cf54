"""Upper rim of a cape: a line across the shoulders and behind the neck."""

from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Points
from hemline.errors import BadGarment
from hemline.meshes import ClosestTree

from .body_lines import fit_to_skin, interpolate_along, joint

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

_SAMPLES = 301
_BEND = 1.6
_SIDEWAYS = 0.92
"""Sideways position of the ends of the rim, as a fraction of half the distance between the shoulder joints."""
_FORWARD = 0.12
"""Forward position of the ends of the rim from the shoulder joints, as a fraction of half their distance."""


def cape_rim(shaped: "ShapedBody", tree: ClosestTree, count: int, height: float) -> Points:
    """Returns the upper line of a cape, from the right shoulder behind the neck to the left one.

    Seen from above, it is z = z_neck + (z_end - z_neck) |x / x_end|^1.6. It passes close behind the neck and ends
    before the crest of the shoulders, a little inside of the shoulder joints.

    Args:
        shaped: The body.
        tree: Surface of the body at rest.
        count: Number of points, evenly spaced along the line.
        height: Height above the skin; up to 2.5 times as much where the line bridges a furrow [m].

    Returns:
        Points, right to left [m], float64.

    Raises:
        BadGarment: The body has no shoulders there.
    """
    neck, left, right = (joint(shaped, name) for name in ("neck", "left_shoulder", "right_shoulder"))
    half = (left[0] - right[0]) / 2
    surface = _upper_surface(tree, neck, half)
    x = np.linspace(-1, 1, _SAMPLES) * _SIDEWAYS * half
    nape = _nape(surface, neck, half)
    end = (left[2] + right[2]) / 2 + _FORWARD * half
    z = nape + (end - nape) * np.abs(x / x[-1]) ** _BEND
    y = _heights(surface, x + neck[0], z)
    if np.isnan(y).any():
        got = f"no surface above {np.isnan(y).sum()} of {len(y)} points"
        raise BadGarment("a cape needs shoulders to lie on", got, "use an upright body facing +z, at rest")
    line = np.stack([x + neck[0], _smooth(y), z], axis=1)
    line = fit_to_skin(line, tree, height, _smooth)
    return interpolate_along(line, line, np.linspace(0, 1, count))


def _upper_surface(tree: ClosestTree, neck: np.ndarray, half: float) -> np.ndarray:
    """Returns the corners of the triangles of the shoulders, without the head."""
    centre = tree.corners.mean(axis=1) - neck
    near_shoulders = (np.abs(centre[:, 0]) < 1.5 * half) & (centre[:, 1] > -1.5 * half) & (centre[:, 1] < 0.3 * half)
    return tree.corners[near_shoulders]


def _nape(surface: np.ndarray, neck: np.ndarray, half: float) -> float:
    """Returns the z at which the skin behind the neck is lower than the joint by 8 % of half the shoulders' width."""
    z = neck[2] - np.linspace(0.1, 0.8, 71) * half
    y = _heights(surface, np.full(len(z), neck[0] + 0.02 * half), z)
    low = np.flatnonzero(y < neck[1] - 0.08 * half)
    return float(z[low[0]]) if len(low) else float(neck[2] - 0.35 * half)


def _heights(surface: np.ndarray, x: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Returns the height of the highest triangle above each (x, z); NaN where there is none."""
    result = np.full(len(x), np.nan)
    a, b, c = (surface[:, corner][:, [0, 2]] for corner in range(3))
    for index, point in enumerate(np.stack([x, z], axis=1)):
        areas = np.stack(
            [_cross(b - point, c - point), _cross(c - point, a - point), _cross(a - point, b - point)], axis=1
        )
        hit = (areas >= 0).all(axis=1) | (areas <= 0).all(axis=1)
        hit &= np.abs(areas.sum(axis=1)) > 0
        if hit.any():
            weights = areas[hit] / areas[hit].sum(axis=1, keepdims=True)
            result[index] = (weights * surface[hit, :, 1]).sum(axis=1).max()
    return result


def _cross(one: np.ndarray, two: np.ndarray) -> np.ndarray:
    return one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]


def _smooth(line: np.ndarray) -> np.ndarray:
    """Returns the running mean over 10 % of the line, with its ends kept."""
    from scipy.ndimage import uniform_filter1d

    wide = _SAMPLES // 10
    padded = np.concatenate([2 * line[:1] - line[wide:0:-1], line, 2 * line[-1:] - line[-2 : -wide - 2 : -1]])
    return uniform_filter1d(padded, wide, axis=0)[wide:-wide]
