"""Start shape of a cape: over the shoulders, then down in folds that keep its cut."""

import numpy as np

from hemline.arrays import Float, Points
from hemline.meshes import ClosestTree

from .body_lines import interpolate_along, lengths

_CLING_DISTANCE = 0.026
"""Distance from the rim over which the cloth follows the skin exactly [m]."""
_FIRST_DESCENT = 0.17
"""Angle below the horizontal at which the cloth leaves the rim [rad]."""
_STEEP_DISTANCE = 0.16
"""Distance from the rim at which the cloth reaches its steepest angle [m]."""


def hanging_columns(
    rim: Points, tree: ClosestTree, *, step: float, count: int, spread: float, tilt: float, clearance: float
) -> Float[np.ndarray, "rows columns 3"]:
    """Returns lines that run down from each point of the rim, over the body where it blocks them.

    Each line heads backward, turned outward by up to `spread` at the ends of the rim. Over the first 16 cm it
    steepens from 10 degrees below the horizontal to `tilt` off the vertical. Steps that would come nearer to the skin
    than the clearance follow its tangent plane.

    Args:
        rim: Starts of the lines, right to left [m].
        tree: Surface of the body.
        step: Length of a step [m].
        count: Number of points of a line, the start included.
        spread: Half of the angle between the outermost lines, seen from above [rad].
        tilt: Angle to the vertical at which the lines hang [rad].
        clearance: Least distance to the skin [m].

    Returns:
        Points, row by row [m].
    """
    turn = spread * np.linspace(-1, 1, len(rim))
    outward = np.stack([np.sin(turn), np.zeros_like(turn), -np.cos(turn)], axis=1)
    rows, room = [rim], np.zeros(len(rim))
    for row in range(1, count):
        fraction = min(1.0, row * step / _STEEP_DISTANCE)
        fraction = fraction * fraction * (3 - 2 * fraction)
        down = _FIRST_DESCENT * (1 - fraction) + (np.pi / 2 - tilt) * fraction
        heading = outward * np.cos(down) + np.array([0, -np.sin(down), 0])
        ends = rows[-1] + step * heading
        # a line that was `room` away from the skin can be `step` nearer now, not more
        room = room - step
        near = np.flatnonzero(room < clearance)
        clings = row * step < _CLING_DISTANCE or row == 1
        ends[near], room[near] = _beside_body(rows[-1][near], ends[near], tree, step, clearance, clings)
        rows.append(ends)
    return np.stack(rows)


def _beside_body(
    start: np.ndarray, ends: np.ndarray, tree: ClosestTree, step: float, clearance: float, clings: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Moves the ends of steps out of the body, or onto it where they cling; returns them and their distances to it.

    The length of each step stays.
    """
    for _ in range(6):
        closest = tree.closest(ends)
        normal = tree.outward(closest)
        height = ((ends - closest.positions) * normal).sum(axis=1)
        distance = np.where(height < 0, -closest.distances, closest.distances)
        near = (distance < clearance) | clings
        if not near.any():
            break
        ends[near] = (closest.positions + clearance * 1.02 * normal)[near]
        step_vectors = ends - start
        ends = start + step_vectors * (step / np.linalg.norm(step_vectors, axis=1, keepdims=True))
    return ends, distance


def fold_sheet(
    sheet: Float[np.ndarray, "rows columns 3"],
    widths: Float[np.ndarray, " rows"],
    ease: Float[np.ndarray, " rows"],
    folds: int,
) -> Float[np.ndarray, "rows columns 3"]:
    """Folds a sheet into sine waves on its outer side, so that each row is as wide as it was cut.

    The amplitude of each row is found by bisection on its true length; points are spread evenly along the wave.

    Args:
        sheet: Rows of points [m].
        widths: Width of each row in the cut [m].
        ease: Fraction of its amplitude that each row gets, 0 where the cloth lies flat on the shoulders.
        folds: Number of waves across a row.

    Returns:
        Points [m].
    """
    rows, columns, _ = sheet.shape
    fine = np.linspace(0, 1, max(columns, 32 * folds + 1))
    normal = np.cross(np.gradient(sheet, axis=0), np.gradient(sheet, axis=1))
    base = np.stack([interpolate_along(sheet[row], sheet[row], fine) for row in range(rows)])
    outward = np.stack([interpolate_along(sheet[row], normal[row], fine) for row in range(rows)])
    outward /= np.linalg.norm(outward, axis=2, keepdims=True)
    wave = outward * (1 + np.sin(2 * np.pi * folds * fine - np.pi / 2))[None, :, None]
    low, high = np.zeros(rows), np.full(rows, 0.2)
    for _ in range(14):
        middle = (low + high) / 2
        short = lengths(_in_columns(base + middle[:, None, None] * wave, columns)) < widths
        low, high = np.where(short, middle, low), np.where(short, high, middle)
    return _in_columns(base + (ease * low)[:, None, None] * wave, columns)


def _in_columns(lines: np.ndarray, columns: int) -> np.ndarray:
    fraction = np.linspace(0, 1, columns)
    return np.stack([interpolate_along(line, line, fraction) for line in lines])
