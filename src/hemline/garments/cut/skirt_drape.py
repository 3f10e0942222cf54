"""Start shape of a skirt: straight lines from the waist past the hips, with the rest of its width in pleats."""

import numpy as np

from hemline.arrays import Float, Points
from hemline.errors import BadGarment
from hemline.meshes import ClosestTree

from .body_lines import lengths

ColumnVectors = Float[np.ndarray, "columns 3"]
"""One vector for each line."""

_LINE_POINTS = 60
"""Number of points of a line that are tested against the body."""
_STEP = 0.02
_STEEPEST = 1.3


def outward_of(rim: Points) -> ColumnVectors:
    """Returns level unit vectors away from a line around the body: normals of the ellipse as wide and deep as the line.

    The line's own normals would meet at the small of the back, where it turns inward.
    """
    low, high = rim.min(axis=0), rim.max(axis=0)
    away = (rim - (low + high) / 2) / np.array([(high[0] - low[0]) ** 2, np.inf, (high[2] - low[2]) ** 2])
    return away / np.linalg.norm(away, axis=1, keepdims=True)


def line_tilts(
    rim: Points, outward: ColumnVectors, tree: ClosestTree, *, length: float, tilt: float, clearance: float
) -> Float[np.ndarray, " columns"]:
    """Returns the angle to the vertical of a straight line down from each point of a closed rim, clear of the body.

    Args:
        rim: Starts of the lines [m].
        outward: Level directions in which the lines lean.
        tree: The body's surface.
        length: Length of a line [m].
        tilt: Least angle [rad].
        clearance: Least distance to the skin [m].

    Returns:
        Angles that change slowly around the rim [rad].

    Raises:
        BadGarment: Some line meets the body at every angle.
    """
    from scipy.ndimage import gaussian_filter1d, maximum_filter1d

    tilts, distances = np.full(len(rim), tilt), length * np.linspace(0, 1, _LINE_POINTS)[2:]
    blocked = np.arange(len(rim))
    while len(blocked):
        points = rim[blocked, None] + distances[:, None] * _down(outward[blocked], tilts[blocked])[:, None]
        near = tree.signed_distances(points.reshape(-1, 3)) < clearance
        blocked = blocked[near.reshape(points.shape[:2]).any(axis=1)]
        tilts[blocked] += _STEP
        if (tilts > _STEEPEST).any():
            raise BadGarment("a skirt must hang past the body", "hips that no line from the waist passes", "shorten it")
    wide = len(rim) // 12
    return gaussian_filter1d(maximum_filter1d(tilts, 2 * wide + 1, mode="wrap"), wide / 2, mode="wrap")


def hang_rows(
    rim: Points, outward: ColumnVectors, tilts: Float[np.ndarray, " columns"], distances: Float[np.ndarray, " rows"]
) -> Float[np.ndarray, "rows columns 3"]:
    """Returns points at given distances down the straight lines [m]."""
    return rim + distances[:, None, None] * _down(outward, tilts)


def pleat_sheet(
    sheet: Float[np.ndarray, "rows columns 3"],
    normals: ColumnVectors,
    widths: Float[np.ndarray, " rows"],
    ease: Float[np.ndarray, " rows"],
    folds: int,
) -> Float[np.ndarray, "rows columns 3"]:
    """Folds a closed sheet into waves on its outer side, so that each row is as wide as it was cut.

    The amplitude of each row is found by bisection on its true length; points are spread evenly along the wave.

    Args:
        sheet: Rows of points, the last column beside the first [m].
        normals: Directions of the waves, one a column.
        widths: Width of each row in the cut [m].
        ease: Fraction of its amplitude that each row gets.
        folds: Number of waves around the body.

    Returns:
        Points [m].
    """
    columns = sheet.shape[1]
    closed = np.concatenate([sheet, sheet[:, :1]], axis=1)
    lean = np.concatenate([normals, normals[:1]])
    fine = np.linspace(0, 1, max(columns, 32 * folds) + 1)
    place = np.linspace(0, 1, columns + 1)
    base, wave = (
        _at(closed, place, fine),
        _at(lean[None], place, fine) * (1 - np.cos(2 * np.pi * folds * fine))[:, None],
    )
    low, high = np.zeros(len(sheet)), np.full(len(sheet), 0.3)
    for _ in range(16):
        middle = (low + high) / 2
        short = lengths(base + middle[:, None, None] * wave) < widths
        low, high = np.where(short, middle, low), np.where(short, high, middle)
    waves = base + (ease * low)[:, None, None] * wave
    return np.stack([_evenly(line, columns) for line in waves])


def _down(outward: ColumnVectors, tilts: np.ndarray) -> np.ndarray:
    return outward * np.sin(tilts)[:, None] - np.array([0.0, 1.0, 0.0]) * np.cos(tilts)[:, None]


def _at(rows: np.ndarray, place: np.ndarray, fine: np.ndarray) -> np.ndarray:
    from scipy.interpolate import interp1d

    return interp1d(place, rows, axis=1)(fine)


def _evenly(line: np.ndarray, columns: int) -> np.ndarray:
    distances = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    targets = distances[-1] * np.arange(columns) / columns
    return np.stack([np.interp(targets, distances, line[:, axis]) for axis in range(3)], axis=1)
