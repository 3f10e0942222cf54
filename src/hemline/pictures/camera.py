"""A perspective camera, and its placement so that everything is in view."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hemline.arrays import Float, FramesOfVertices, Points
from hemline.errors import BadInput

VIEWS_DEG = {
    "front": 0.0,
    "three_quarter": 35.0,
    "side": 90.0,
    "back_three_quarter": 145.0,
    "back": 180.0,
}
"""Azimuth of each named view about the vertical, from the direction +z that a body faces [degrees]."""

ELEVATION_DEG = 9.0
"""Angle by which the camera looks down [degrees]."""


@dataclass(frozen=True)
class Camera:
    """A perspective camera that looks from `eye` to `target`, y up in the picture.

    Attributes:
        eye: Position [m].
        target: Point in the middle of the picture [m].
        field_of_view: Vertical opening angle [rad].
    """

    eye: tuple[float, float, float]
    target: tuple[float, float, float]
    field_of_view: float = 0.45

    @property
    def axes(self) -> Float[np.ndarray, "3 3"]:
        """Rows: the camera's right, up and backward directions in the world."""
        back = np.subtract(self.eye, self.target)
        back = back / np.linalg.norm(back)
        right = np.cross([0.0, 1.0, 0.0], back)
        right = right / np.linalg.norm(right) if np.linalg.norm(right) > 1e-9 else np.array([1.0, 0.0, 0.0])
        return np.stack([right, np.cross(back, right), back])

    def shift(self, offset: Float[np.ndarray, "3"]) -> "Camera":
        """Returns this camera moved by `offset` [m]."""
        eye, target = np.add(self.eye, offset), np.add(self.target, offset)
        return Camera(tuple(eye.tolist()), tuple(target.tolist()), self.field_of_view)

    def project(self, points: Points, size: tuple[int, int]) -> Float[np.ndarray, "points 3"]:
        """Returns pixel coordinates x (right), y (down) of points, and their depth along the view [m].

        Args:
            points: Points in the world [m].
            size: Width and height of the picture [pixels].
        """
        width, height = size
        local = (np.asarray(points, np.float64) - self.eye) @ self.axes.T
        depth = -local[:, 2]
        scale = 0.5 * height / np.tan(0.5 * self.field_of_view) / depth
        return np.stack([0.5 * width + local[:, 0] * scale, 0.5 * height - local[:, 1] * scale, depth], axis=1)


def view_axes(view: str) -> Float[np.ndarray, "3 3"]:
    """Returns right, up and backward direction, as rows, of a camera in a named view.

    Raises:
        BadInput: The view is unknown.
    """
    if view not in VIEWS_DEG:
        raise BadInput("no such view", repr(view), f"choose one of {', '.join(VIEWS_DEG)}")
    azimuth, elevation = np.radians(VIEWS_DEG[view]), np.radians(ELEVATION_DEG)
    back = np.array([np.sin(azimuth) * np.cos(elevation), np.sin(elevation), np.cos(azimuth) * np.cos(elevation)])
    return Camera(tuple(back.tolist()), (0.0, 0.0, 0.0)).axes


def frame_points(
    points: Points,
    view: str = "three_quarter",
    *,
    size: tuple[int, int] = (640, 640),
    margin: float = 0.06,
    field_of_view: float = 0.45,
) -> Camera:
    r"""Returns the nearest camera in a named view that sees all points.

    With points $(x, y, z)$ along the camera's axes and $t$ the tangent of half the opening angle, a camera at
    $(c, d)$ sees them all in width if $d t \ge \pm(x - c) + z t$; adding both gives the smallest $d$ and its $c$. The
    same holds in height; the larger $d$ is taken.

    Args:
        points: Points that must be in view [m].
        view: One of `VIEWS_DEG`.
        size: Width and height of the picture [pixels].
        margin: Fraction of the picture left free at each edge.
        field_of_view: Vertical opening angle [rad].

    Raises:
        BadInput: The view is unknown, or no point is finite.
    """
    axes = view_axes(view)
    points = np.asarray(points, np.float64).reshape(-1, 3)
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        raise BadInput("nothing to look at", "no finite point", "give vertices that are numbers")
    x, y, z = axes @ points.T
    half = (1 - 2 * margin) * np.tan(0.5 * field_of_view)
    centre_x, distance_x = _fit_axis(x, z, half * size[0] / size[1])
    centre_y, distance_y = _fit_axis(y, z, half)
    distance = max(distance_x, distance_y, z.max() + 0.05)
    eye = np.array([centre_x, centre_y, distance]) @ axes
    target = np.array([centre_x, centre_y, float(np.median(z))]) @ axes
    return Camera(tuple(eye.tolist()), tuple(target.tolist()), field_of_view)


def frame_clip(
    frames: FramesOfVertices | Sequence[Points],
    view: str = "three_quarter",
    *,
    size: tuple[int, int] = (640, 640),
    fps: float = 30.0,
    follow: bool = True,
    margin: float = 0.06,
) -> list[Camera]:
    """Returns one camera per frame, which follows the middle of the points or stands still.

    Args:
        frames: Points that must be in view, frame by frame [m].
        view: One of `VIEWS_DEG`.
        size: Width and height of the picture [pixels].
        fps: Frames per second, for the smoothing of the path of the camera.
        follow: Whether the camera follows horizontally, smoothed over a quarter of a second; otherwise one camera sees
            all frames.
        margin: Fraction of the picture left free at each edge.

    Raises:
        BadInput: See `frame_points`.
    """
    if not len(frames):
        raise BadInput("nothing to look at", "a clip without frames", "give at least one frame")
    if not follow:
        return [frame_points(np.concatenate(list(frames)), view, size=size, margin=margin)] * len(frames)
    middles = np.array([0.5 * (np.min(points, axis=0) + np.max(points, axis=0)) for points in frames], np.float64)
    middles[:, 1] = 0
    path = _smooth(middles, sigma=0.25 * fps)
    corners = np.concatenate([points - step for points, step in zip(frames, path, strict=True)])
    camera = frame_points(corners, view, size=size, margin=margin)
    return [camera.shift(step) for step in path]


def _fit_axis(across: np.ndarray, towards: np.ndarray, tangent: float) -> tuple[float, float]:
    high, low = (across + tangent * towards).max(), (-across + tangent * towards).max()
    return 0.5 * (high - low), 0.5 * (high + low) / tangent


def _smooth(path: np.ndarray, sigma: float) -> np.ndarray:
    reach = int(np.ceil(3 * sigma))
    weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / max(sigma, 1e-9)) ** 2)
    padded = np.pad(path, ((reach, reach), (0, 0)), mode="reflect", reflect_type="odd") if len(path) > reach else None
    if padded is None:
        padded = np.pad(path, ((reach, reach), (0, 0)), mode="edge")
    return np.stack([np.convolve(axis, weights / weights.sum(), mode="valid") for axis in padded.T], axis=1)
