"""Finds which axis of a clip's world is up, from the body in its frames."""

from dataclasses import dataclass

import numpy as np

from hemline.arrays import Float
from hemline.errors import BadMotion
from hemline.motions.quaternions import Quaternion, Vector, between, from_axis_angle

AXES = {"y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0), "x": (1.0, 0.0, 0.0)} | {
    "-y": (0.0, -1.0, 0.0),
    "-z": (0.0, 0.0, -1.0),
    "-x": (-1.0, 0.0, 0.0),
}
"""Directions by name."""

_ERECT = 0.7
"""Least cosine of trunk and body with the vertical in a frame in which a person stands, walks or sits."""
_PLAIN, _RARE = 0.8, 0.15
"""Another axis is up if the body is erect along it in more than the first fraction of all frames, and along the
expected one in less than the second."""
_FLOOR = (-0.25, 0.3)
"""Range of the lowest joint of a body that stands on the floor of the world, as fractions of the leg."""
_LYING_LOWEST, _LYING_PELVIS = (0.0, 0.2), (0.05, 0.7)
"""Ranges of the lowest joint and of the pelvis of a body that lies, crawls or sits on that floor."""
_FLAT_LOWEST, _FLAT_PELVIS = (0.0, 0.12), (0.05, 0.3)
"""Ranges of these for a body that lies flat, which is seldom so by chance."""
_JOURNEY = 1.2
"""A body does not travel farther than this along its own length, as a fraction of the leg."""


@dataclass(frozen=True, eq=False)
class Upright:
    """The axis that is up.

    Attributes:
        axis: Name of the axis, such as `z`.
        note: A sentence that says why, if it is not the expected one.
        doubt: What is odd about it, a value and a cure; empty: nothing.
    """

    axis: str
    note: str = ""
    doubt: tuple[str, str, str] | tuple[()] = ()


@dataclass(frozen=True, eq=False)
class BodyPlaces:
    """Points of a body in each frame, in the file's axes and unit.

    Attributes:
        pelvis: Midway between the hips.
        head: The head.
        ankles: Midway between the ankles.
        joints: All joints of the body.
        leg: Length of a leg.
    """

    pelvis: Float[np.ndarray, "frames 3"]
    head: Float[np.ndarray, "frames 3"]
    ankles: Float[np.ndarray, "frames 3"]
    joints: Float[np.ndarray, "frames joints 3"]
    leg: float


def find_up(points: BodyPlaces, expected: str, declared: str | None, file: str, *, by_format: bool = False) -> Upright:
    """Returns the axis that is up.

    A body that is erect along another axis than the expected one, in nearly all frames, shows that the file was made
    for another world, unless it lies on the floor of the expected one.

    Args:
        points: The body in some frames.
        expected: The axis that is up by the format, or by the zero pose.
        declared: The axis that the user names; None: found.
        file: Name of the file in messages.
        by_format: Whether the format says what is up, as glTF does; then a body must stand on the floor of another
            world, too, before that one is taken.

    Raises:
        BadMotion: The declared axis is none of x, y, z, -x, -y, -z.
    """
    if declared is not None:
        if declared not in AXES:
            raise BadMotion(f"the axis that is up in {file} must be one of {', '.join(AXES)}", declared, "name one")
        return Upright(declared, f"{declared} is up, as declared")
    shares = {axis: _erect_share(points, np.array(direction)) for axis, direction in AXES.items()}
    best = max(shares, key=lambda axis: (shares[axis], axis == expected, axis == "y"))
    if shares[expected] >= _RARE or best == expected:
        return Upright(expected)
    if shares[best] >= _PLAIN and _stands(points, np.array(AXES[best]), np.array(AXES[expected]), by_format):
        found = f"the body stands along {best} in {100 * shares[best]:.0f} % of the frames: {best} is taken to be up"
        return Upright(best, found)
    tilt = _lean(points, np.array(AXES[expected]))
    lies = "hangs head down" if tilt < -_ERECT else "lies or leans"
    doubt = (
        f"the body of {file} {lies} in {100 * (1 - shares[expected]):.0f} % of the frames, with {expected} up",
        f"erect along {best} in {100 * shares[best]:.0f} %",
        f"if it should stand, say --up={best}; to silence this, --up={expected}",
    )
    return Upright(expected, "", doubt if shares[best] > 0.5 else ())


def turn_to_y(axis: Vector) -> Quaternion:
    """Returns the shortest rotation of an axis to y; a half turn is about x, as from a camera's axes."""
    if axis[1] < -0.999:
        return from_axis_angle(np.array([np.pi, 0, 0]))
    return between(axis, np.array([0.0, 1, 0]))


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12)


def _erect_share(points: BodyPlaces, axis: Vector) -> float:
    """Returns the fraction of the frames in which trunk and body point along an axis."""
    trunk, body = _unit(points.head - points.pelvis) @ axis, _unit(points.head - points.ankles) @ axis
    return float(((trunk > _ERECT) & (body > _ERECT)).mean())


def _lean(points: BodyPlaces, axis: Vector) -> float:
    return float(np.median(_unit(points.head - points.pelvis) @ axis))


def _stands(points: BodyPlaces, axis: Vector, expected: Vector, by_format: bool) -> bool:
    """Whether a body that is erect along an axis stands, and does not lie on the floor of the expected world."""
    along = (points.pelvis @ axis) / points.leg
    if np.ptp(along) > _JOURNEY:
        return False
    bottom = float(np.median((points.joints @ expected).min(axis=1))) / points.leg
    height = float(np.median(points.pelvis @ expected)) / points.leg
    if _within(bottom, _FLAT_LOWEST) and _within(height, _FLAT_PELVIS):
        return False
    lowest = float(np.median((points.joints @ axis).min(axis=1))) / points.leg
    if _within(lowest, _FLOOR) or by_format:
        return _within(lowest, _FLOOR)
    return not (_within(bottom, _LYING_LOWEST) and _within(height, _LYING_PELVIS))


def _within(number: float, limits: tuple[float, float]) -> bool:
    return limits[0] <= number <= limits[1]
