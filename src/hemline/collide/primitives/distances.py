"""Analytic signed distances to spheres, capsules and rounded cones, with gradients, in plain NumPy.

Distances are exact (Euclidean), negative inside and 1-Lipschitz. `primitive_kernels` computes the same, compiled.
"""

import numpy as np

from hemline.arrays import Float, Points
from hemline.errors import BadInput

from .primitive_kernels import ROUND_CONE

Vector = Float[np.ndarray, "3"]
Distances = Float[np.ndarray, " points"]
Shape = Float[np.ndarray, "16"]

_UP = np.array([0.0, 1.0, 0.0])


def sphere(points: Points, centre: Vector, radius: float) -> tuple[Distances, Points]:
    """Returns the distance of points to a sphere [m], and its gradient."""
    offset = np.asarray(points, float) - centre
    size = np.linalg.norm(offset, axis=-1)
    return size - radius, _directions(offset, size)


def capsule(points: Points, start: Vector, end: Vector, radius: float) -> tuple[Distances, Points]:
    """Returns the distance of points to a capsule, all that is within `radius` of a segment [m], and its gradient."""
    return round_cone(points, start, end, radius, radius)


def round_cone(
    points: Points, start: Vector, end: Vector, start_radius: float, end_radius: float
) -> tuple[Distances, Points]:
    r"""Returns the distance of points to the convex hull of two spheres [m], and its gradient.

    With the axis $u$, length $\ell$ and slope $s = (r_0 - r_1) / \ell$, the side is $q \sqrt{1 - s^2} + s t - r_0$ for
    a point at height $t$ and distance $q$ from the axis.

    Source: Quilez, "Distance functions", undated, "rounded cone"; derived anew.
    """
    points, start, end = np.asarray(points, float), np.asarray(start, float), np.asarray(end, float)
    length = float(np.linalg.norm(end - start))
    if length <= abs(start_radius - end_radius) or length < 1e-12:
        return sphere(points, start if start_radius >= end_radius else end, max(start_radius, end_radius))
    axis, slope = (end - start) / length, (start_radius - end_radius) / length
    cosine = np.sqrt(1 - slope * slope)
    along = (points - start) @ axis
    across = points - start - along[:, None] * axis
    q = np.linalg.norm(across, axis=-1)
    foot = along - q * slope / cosine
    distance = q * cosine + along * slope - start_radius
    gradient = cosine * _directions(across, q, _perpendicular(axis)) + slope * axis
    for beyond, centre, radius in ((foot <= 0, start, start_radius), (foot >= length, end, end_radius)):
        there, normal = sphere(points, centre, radius)
        distance = np.where(beyond, there, distance)
        gradient = np.where(beyond[:, None], normal, gradient)
    return distance, gradient


def round_cone_shape(start: Vector, end: Vector, start_radius: float, end_radius: float) -> tuple[int, Shape]:
    """Returns kind and numbers of a rounded cone (capsule, sphere) for the kernels.

    Raises:
        BadInput: A radius is not positive.
    """
    if min(start_radius, end_radius) <= 0:
        raise BadInput("a primitive needs positive radii", (start_radius, end_radius), "give metres above zero")
    shape = np.zeros(16)
    shape[:3], shape[3:6], shape[6:8] = start, end, (start_radius, end_radius)
    return ROUND_CONE, shape


def _directions(offset: Points, size: Distances, otherwise: Vector = _UP) -> Points:
    safe = np.where(size < 1e-12, 1.0, size)[:, None]
    return np.where(size[:, None] < 1e-12, otherwise, offset / safe)


def _perpendicular(axis: Vector) -> Vector:
    other = np.array([axis[1] - axis[2], axis[2] - axis[0], axis[0] - axis[1]])
    if np.abs(other).sum() < 1e-6:
        other = np.array([axis[1], -axis[0], 0.0])
    return other / np.linalg.norm(other)
