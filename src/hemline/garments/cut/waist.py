"""Upper rim of a skirt: a level line around the natural waist."""

from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Float, Points
from hemline.errors import BadGarment
from hemline.meshes import ClosestTree
from hemline.motions.motion import JOINT_NAMES

from .body_lines import fit_to_skin, interpolate_along, joint

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

_TRUNK = ("pelvis", "left_hip", "right_hip", "spine1", "spine2", "spine3")
_LEVELS = np.linspace(0.75, 1.3, 12)
"""Levels at which the waist is searched, as fractions of the height from the pelvis to `spine2`."""
_SAMPLES = 360


def waist_line(shaped: "ShapedBody", tree: ClosestTree, count: int, height: float) -> Points:
    """Returns a closed line around the narrowest level of the trunk between the hips and the chest.

    The line is a tape around that level (its convex hull), moved to its height above the skin. Seen from above it runs
    from the middle of the back over the wearer's left side to the front and back over the right.

    Args:
        shaped: The body.
        tree: Surface of the body at rest.
        count: Number of points, evenly spaced along the line.
        height: Height above the skin; up to 2.5 times as much where the tape bridges a furrow [m].

    Returns:
        Points [m], float64; the first is not repeated at the end.

    Raises:
        BadGarment: The body has no trunk there.
    """
    low, high = joint(shaped, "pelvis")[1], joint(shaped, "spine2")[1]
    corners = _trunk(shaped)
    tapes = [_tape(corners, low + fraction * (high - low)) for fraction in _LEVELS]
    line = min(tapes, key=lambda tape: _length(tape))
    line = fit_to_skin(line, tree, height, _smooth)
    closed = np.concatenate([line, line[:1]])
    return interpolate_along(closed, closed, np.linspace(0, 1, count + 1))[:-1]


def _trunk(shaped: "ShapedBody") -> Float[np.ndarray, "faces 3 3"]:
    """Returns the corners of the triangles that hips and spine move most."""
    body = shaped.body
    strongest = body.weight_indices[np.arange(len(body.weights)), body.weights.argmax(axis=1)]
    on_trunk = np.isin(strongest, [JOINT_NAMES.index(name) for name in _TRUNK])
    return np.asarray(shaped.vertices, np.float64)[body.faces[on_trunk[body.faces].all(axis=1)]]


def _tape(corners: Float[np.ndarray, "faces 3 3"], level: float) -> Points:
    """Returns the convex hull of a level section, at even angles from the middle of the back to the left."""
    from scipy.spatial import ConvexHull

    start, end = corners.reshape(-1, 3), np.roll(corners, -1, axis=1).reshape(-1, 3)
    cut = (start[:, 1] < level) != (end[:, 1] < level)
    start, end = start[cut], end[cut]
    if not len(start):
        raise BadGarment(
            "a skirt needs a waist to hang from", f"no trunk at {level:.2f} m", "use an upright body facing +z, at rest"
        )
    fraction = (level - start[:, 1]) / (end[:, 1] - start[:, 1])
    points = (start + fraction[:, None] * (end - start))[:, [0, 2]]
    hull = points[ConvexHull(points).vertices]
    middle = (hull.min(axis=0) + hull.max(axis=0)) / 2
    away = hull - middle
    angle = np.arctan2(away[:, 0], -away[:, 1]) % (2 * np.pi)
    order = np.argsort(angle)
    wanted = 2 * np.pi * np.arange(_SAMPLES) / _SAMPLES
    at = np.stack([np.interp(wanted, angle[order], away[order, axis], period=2 * np.pi) for axis in (0, 1)], axis=1)
    return np.stack([middle[0] + at[:, 0], np.full(_SAMPLES, level), middle[1] + at[:, 1]], axis=1)


def _length(line: Points) -> float:
    return float(np.linalg.norm(line - np.roll(line, 1, axis=0), axis=1).sum())


def _smooth(line: Points) -> Points:
    """Returns the running mean over 5 % of a closed line."""
    from scipy.ndimage import uniform_filter1d

    return uniform_filter1d(line, _SAMPLES // 20 + 1, axis=0, mode="wrap")
