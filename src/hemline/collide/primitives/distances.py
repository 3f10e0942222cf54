"""Analytic signed distances: sphere, capsule, rounded cone, ellipsoid, box; value and gradient in plain NumPy.

Distances are negative inside and exact (Euclidean), so 1-Lipschitz. The compiled twins are in `primitive_kernels.py`.
"""

import numpy as np

from hemline.arrays import Float, Points
from hemline.errors import BadInput

from .primitive_kernels import BOX, ELLIPSOID, ROUND_CONE

Vector = Float[np.ndarray, "3"]
Rotation = Float[np.ndarray, "3 3"]
Distances = Float[np.ndarray, " points"]
Shape = Float[np.ndarray, "16"]

_UP = np.array([0.0, 1.0, 0.0])


def sphere(points: Points, centre: Vector, radius: float) -> tuple[Distances, Points]:
    """Distance to a sphere and its gradient [m]."""
    offset = np.asarray(points, float) - centre
    size = np.linalg.norm(offset, axis=-1)
    return size - radius, _directions(offset, size)


def capsule(points: Points, start: Vector, end: Vector, radius: float) -> tuple[Distances, Points]:
    """Distance to all points within `radius` of a segment, and its gradient [m]."""
    return round_cone(points, start, end, radius, radius)


def round_cone(
    points: Points, start: Vector, end: Vector, start_radius: float, end_radius: float
) -> tuple[Distances, Points]:
    r"""Distance to the convex hull of two spheres, and its gradient [m].

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


def ellipsoid(points: Points, centre: Vector, radii: Vector, rotation: Rotation) -> tuple[Distances, Points]:
    r"""Exact distance to an ellipsoid, and its gradient [m].

    The closest point is $q_i = e_i^2 y_i / (t + e_i^2)$ with $t$ the largest root of
    $\sum (e_i y_i / (t + e_i^2))^2 = 1$, found here by bisection. The rows of `rotation` are the axes.

    Source: Eberly, "Distance from a point to an ellipse, an ellipsoid, or a hyperellipsoid", 2013.
    """
    radii, rotation = np.asarray(radii, float), np.asarray(rotation, float)
    local = (np.asarray(points, float) - centre) @ rotation.T
    folded = np.maximum(np.abs(local), 1e-9 * radii.min())
    low = (radii * (folded - radii)).max(1)
    high = low + np.linalg.norm(radii * folded, axis=1) + 1e-12
    for _ in range(80):
        middle = (low + high) / 2
        right = ((radii * folded / (middle[:, None] + radii**2)) ** 2).sum(1) > 1
        low, high = np.where(right, middle, low), np.where(right, high, middle)
    closest = radii**2 * folded / (high[:, None] + radii**2)
    normal = closest / radii**2
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return ((folded - closest) * normal).sum(1), np.copysign(normal, local) @ rotation


def box(
    points: Points, centre: Vector, half_sizes: Vector, rotation: Rotation, rounding: float = 0.0
) -> tuple[Distances, Points]:
    """Distance to a box with edges rounded outward by `rounding`, and its gradient [m].

    The rows of `rotation` are its axes.
    """
    rotation = np.asarray(rotation, float)
    local = (np.asarray(points, float) - centre) @ rotation.T
    q = np.abs(local) - half_sizes
    outer = np.maximum(q, 0)
    outside = np.linalg.norm(outer, axis=1)
    inside = q.max(1)
    flat = np.eye(3)[q.argmax(1)]
    normal = np.where((outside > 0)[:, None], _directions(outer, outside), flat)
    return np.where(outside > 0, outside, inside) - rounding, np.copysign(normal, local) @ rotation


def round_cone_shape(start: Vector, end: Vector, start_radius: float, end_radius: float) -> tuple[int, Shape]:
    """Kind and numbers of a rounded cone (capsule, sphere) for the kernels.

    Raises:
        BadInput: A radius is not positive.
    """
    if min(start_radius, end_radius) <= 0:
        raise BadInput("a primitive needs positive radii", (start_radius, end_radius), "give metres above zero")
    shape = np.zeros(16)
    shape[:3], shape[3:6], shape[6:8] = start, end, (start_radius, end_radius)
    return ROUND_CONE, shape


def ellipsoid_shape(centre: Vector, radii: Vector, rotation: Rotation) -> tuple[int, Shape]:
    """Kind and numbers of an ellipsoid for the kernels; rows of `rotation` are its axes.

    Raises:
        BadInput: A radius is not positive.
    """
    return ELLIPSOID, _oriented(centre, radii, rotation, 0.0)


def box_shape(centre: Vector, half_sizes: Vector, rotation: Rotation, rounding: float = 0.0) -> tuple[int, Shape]:
    """Kind and numbers of a box for the kernels; rows of `rotation` are its axes.

    Raises:
        BadInput: A half size is not positive.
    """
    return BOX, _oriented(centre, half_sizes, rotation, rounding)


def _oriented(centre: Vector, sizes: Vector, rotation: Rotation, rounding: float) -> Shape:
    sizes = np.asarray(sizes, float)
    if not (sizes > 0).all():
        raise BadInput("a primitive needs positive radii", sizes.tolist(), "give metres above zero")
    shape = np.zeros(16)
    shape[:3], shape[3:6], shape[6:15], shape[15] = centre, sizes, np.asarray(rotation, float).ravel(), rounding
    return shape


def _directions(offset: Points, size: Distances, otherwise: Vector = _UP) -> Points:
    safe = np.where(size < 1e-12, 1.0, size)[:, None]
    return np.where(size[:, None] < 1e-12, otherwise, offset / safe)


def _perpendicular(axis: Vector) -> Vector:
    other = np.array([axis[1] - axis[2], axis[2] - axis[0], axis[0] - axis[1]])
    if np.abs(other).sum() < 1e-6:
        other = np.array([axis[1], -axis[0], 0.0])
    return other / np.linalg.norm(other)
