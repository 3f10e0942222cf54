"""Rotations as unit quaternions wxyz, acting on column vectors. Plain NumPy over any leading axes."""

import numpy as np
from jaxtyping import Float

Quaternion = Float[np.ndarray, "... 4"]
"""Unit quaternions wxyz over any leading axes."""

Matrix = Float[np.ndarray, "... 3 3"]
"""Rotation matrices over any leading axes."""

Vector = Float[np.ndarray, "... 3"]
"""Vectors over any leading axes."""


def multiply(first: Quaternion, second: Quaternion) -> Quaternion:
    """Returns the product `first second`: the rotation that turns by `second`, then by `first`."""
    w, x, y, z = np.moveaxis(np.asarray(first), -1, 0)
    a, b, c, d = np.moveaxis(np.asarray(second), -1, 0)
    return np.stack(
        [
            w * a - x * b - y * c - z * d,
            w * b + x * a + y * d - z * c,
            w * c - x * d + y * a + z * b,
            w * d + x * c - y * b + z * a,
        ],
        axis=-1,
    )


def inverse(rotation: Quaternion) -> Quaternion:
    """Returns the opposite rotation."""
    return np.asarray(rotation) * np.array([1, -1, -1, -1], dtype=np.asarray(rotation).dtype)


def rotate(rotation: Quaternion, vector: Vector) -> Vector:
    """Turns vectors by rotations."""
    rotation, vector = np.asarray(rotation), np.asarray(vector)
    w, axis = rotation[..., :1], rotation[..., 1:]
    twice = 2 * np.cross(axis, vector)
    return vector + w * twice + np.cross(axis, twice)


def normalise(rotation: Quaternion) -> Quaternion:
    """Scales quaternions to length one."""
    return rotation / np.linalg.norm(rotation, axis=-1, keepdims=True)


def angle(rotation: Quaternion) -> Float[np.ndarray, "..."] | np.floating:
    """Returns the angle of a rotation, from 0 to pi [rad]."""
    rotation = np.asarray(rotation)
    return 2 * np.arctan2(np.linalg.norm(rotation[..., 1:], axis=-1), np.abs(rotation[..., 0]))


def slerp(start: Quaternion, end: Quaternion, fraction: Float[np.ndarray, "..."] | float) -> Quaternion:
    r"""Interpolates from `start` to `end` along the shorter arc, at constant angular speed.

    $$q(t) = \frac{\sin((1-t)\theta)\, q_0 + \sin(t\theta)\, q_1}{\sin\theta}, \qquad \cos\theta = |q_0 \cdot q_1|$$

    Args:
        start: Rotations at fraction 0.
        end: Rotations at fraction 1.
        fraction: Fraction of the arc; broadcasts against the leading axes.

    Source: Shoemake, "Animating rotation with quaternion curves", 1985, section 3.3.
    """
    cosine = np.sum(start * end, axis=-1, keepdims=True)
    end, cosine = np.where(cosine < 0, -end, end), np.minimum(np.abs(cosine), 1.0)
    fraction = np.asarray(fraction, dtype=cosine.dtype)[..., None]
    theta = np.arccos(cosine)
    near = theta < 1e-4
    sine = np.where(near, 1.0, np.sin(theta))
    from_start = np.where(near, 1 - fraction, np.sin((1 - fraction) * theta) / sine)
    from_end = np.where(near, fraction, np.sin(fraction * theta) / sine)
    return normalise(from_start * start + from_end * end)


def continuous(rotations: Float[np.ndarray, "frames ... 4"]) -> Float[np.ndarray, "frames ... 4"]:
    """Chooses the signs of quaternions so that neighbours in time are near, and the first has w >= 0."""
    flips = np.where(np.sum(rotations[1:] * rotations[:-1], axis=-1) < 0, -1, 1)
    first = np.where(rotations[:1, ..., 0] < 0, -1, 1)
    signs = np.cumprod(np.concatenate([first, flips]), axis=0)
    return rotations * signs[..., None].astype(rotations.dtype)


def to_matrix(rotation: Quaternion) -> Matrix:
    """Returns the rotation matrices of unit quaternions."""
    w, x, y, z = np.moveaxis(np.asarray(rotation), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def from_matrix(matrix: Matrix) -> Quaternion:
    """Returns the unit quaternions, with w >= 0, of rotation matrices.

    Source: Shepperd, "Quaternion from rotation matrix", 1978: the largest of the four candidates is the divisor, so no
    digits are lost.
    """
    m = np.asarray(matrix)
    xx, yy, zz = m[..., 0, 0], m[..., 1, 1], m[..., 2, 2]
    squares = np.stack([1 + xx + yy + zz, 1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz], axis=-1)
    wx, wy, wz = m[..., 2, 1] - m[..., 1, 2], m[..., 0, 2] - m[..., 2, 0], m[..., 1, 0] - m[..., 0, 1]
    xy, xz, yz = m[..., 0, 1] + m[..., 1, 0], m[..., 0, 2] + m[..., 2, 0], m[..., 1, 2] + m[..., 2, 1]
    table = np.stack(
        [
            np.stack([squares[..., 0], wx, wy, wz], axis=-1),
            np.stack([wx, squares[..., 1], xy, xz], axis=-1),
            np.stack([wy, xy, squares[..., 2], yz], axis=-1),
            np.stack([wz, xz, yz, squares[..., 3]], axis=-1),
        ],
        axis=-2,
    )
    best = np.argmax(squares, axis=-1)[..., None, None]
    chosen = normalise(np.take_along_axis(table, best, axis=-2)[..., 0, :])
    return np.where(chosen[..., :1] < 0, -chosen, chosen)


def from_axis_angle(vector: Vector) -> Quaternion:
    """Returns the unit quaternions of rotation vectors, axis times angle [rad]."""
    vector = np.asarray(vector)
    half = 0.5 * np.linalg.norm(vector, axis=-1, keepdims=True)
    return np.concatenate([np.cos(half), 0.5 * np.sinc(half / np.pi) * vector], axis=-1)


def to_axis_angle(rotation: Quaternion) -> Vector:
    """Returns the rotation vectors of unit quaternions, axis times angle, no longer than pi [rad]."""
    rotation = np.asarray(rotation)
    turned = np.where(rotation[..., :1] < 0, -rotation, rotation)
    sine = np.linalg.norm(turned[..., 1:], axis=-1, keepdims=True)
    half = np.arctan2(sine, turned[..., :1])
    # 2 half / sine tends to 2 for the identity
    return np.where(sine < 1e-9, 2.0, 2 * half / np.maximum(sine, 1e-9)) * turned[..., 1:]


def heading(rotation: Quaternion) -> Quaternion:
    """Returns the part of rotations that turns about the vertical (y); its inverse times the rotation is the tilt."""
    rotation = np.asarray(rotation)
    w, y = rotation[..., 0], rotation[..., 2]
    length = np.hypot(w, y)
    lost = length < 1e-9  # upside down: no heading is nearer than another
    zero, length = np.zeros_like(w), np.where(lost, 1.0, length)
    return np.stack([np.where(lost, 1.0, w / length), zero, np.where(lost, 0.0, y / length), zero], axis=-1)


def from_euler(angles: Float[np.ndarray, "... turns"], order: str) -> Quaternion:
    """Returns the unit quaternions of intrinsic turns about the axes named in `order`, as BVH lists them.

    `from_euler([a, b, c], "ZYX")` is R = Rz(a) Ry(b) Rx(c).

    Args:
        angles: One angle for each letter of `order` [rad].
        order: Letters X, Y, Z, in any number.
    """
    angles = np.asarray(angles)
    total = np.zeros((*angles.shape[:-1], 4), dtype=angles.dtype)
    total[..., 0] = 1
    for index, axis in enumerate(order):
        turn = np.zeros_like(total)
        turn[..., 0] = np.cos(0.5 * angles[..., index])
        turn[..., 1 + "XYZ".index(axis)] = np.sin(0.5 * angles[..., index])
        total = multiply(total, turn)
    return total


def between(start: Vector, end: Vector) -> Quaternion:
    """Returns the smallest rotation of the direction `start` onto the direction `end`; half turns are about z or x."""
    start, end = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    start = start / np.linalg.norm(start, axis=-1, keepdims=True)
    end = end / np.linalg.norm(end, axis=-1, keepdims=True)
    cosine = np.sum(start * end, axis=-1, keepdims=True)
    if np.any(cosine < -1 + 1e-9):
        side = np.where(np.abs(start[..., 2:]) > 0.9, [1.0, 0, 0], [0, 0, 1.0])
        across = np.cross(np.cross(start, side), start)
        opposite = np.concatenate([np.zeros_like(cosine), across], axis=-1)
    else:
        opposite = 0.0
    smallest = np.concatenate([1 + cosine, np.cross(start, end)], axis=-1)
    return normalise(np.where(cosine < -1 + 1e-9, opposite, smallest))
