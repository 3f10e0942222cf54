"""Rotations by quarter turns, the means of rotations, and rotations from pairs of directions."""

import itertools

import numpy as np

from hemline.motions.quaternions import (
    Quaternion,
    Vector,
    angle,
    between,
    from_axis_angle,
    from_matrix,
    inverse,
    multiply,
    rotate,
)

IDENTITY = np.array([1.0, 0, 0, 0])
LEFT, UP, FORWARD = np.eye(3)
OUT = {"left": LEFT, "right": -LEFT}
"""Direction of an arm in our T-pose, by its side."""
SIDES = {"left": 1.0, "right": -1.0}
"""Sign of x, by the side."""


def _quarters() -> Quaternion:
    axes = [np.array(order)[:, None] == np.arange(3) for order in itertools.permutations(range(3))]
    signed = [axis * np.array(signs)[:, None] for axis in axes for signs in itertools.product((1.0, -1.0), repeat=3)]
    return from_matrix(np.array([matrix for matrix in signed if np.linalg.det(matrix) > 0]))


QUARTERS = _quarters()
"""The 24 rotations that take axes to axes."""


def nearest_quarter(rotation: Quaternion) -> Quaternion:
    """Returns the rotation by quarter turns that is nearest to a rotation."""
    return QUARTERS[np.argmax(np.abs(QUARTERS @ rotation))]


def apart_deg(first: Quaternion, second: Quaternion) -> float:
    """Returns the angle between two rotations [deg]."""
    return float(np.degrees(angle(multiply(inverse(first), second))))


def mean_rotation(rotations: Quaternion) -> Quaternion:
    """Returns the mean of rotations (frames, 4).

    Source: Markley et al., "Averaging quaternions", 2007: the eigenvector of the largest eigenvalue of the sum of
    their outer products.
    """
    return np.linalg.eigh(rotations.T @ rotations)[1][:, -1]


def turn_axes(first: Vector, onto: Vector, second: Vector, near: Vector) -> Quaternion | None:
    """Returns the rotation of `first` onto a direction that brings `second` as near as possible to another.

    Args:
        first: A direction.
        onto: Its direction after the turn, of any length.
        second: Another direction.
        near: The direction that `second` shall be near to.

    Returns:
        None if `onto` has no length, or `near` lies along it.
    """
    length = np.linalg.norm(onto)
    if not length > 0:
        return None
    along = onto / length
    across = near - (near @ along) * along
    if np.linalg.norm(across) <= 1e-6 * max(np.linalg.norm(near), 1e-12):
        return None
    smallest = between(first, along)
    now = rotate(smallest, second)
    twist = np.arctan2(np.cross(now, across) @ along, now @ across)
    return multiply(from_axis_angle(twist * along), smallest)
