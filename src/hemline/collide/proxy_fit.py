"""Fit rounded cones to the parts of a body at rest."""

from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Float, Points
from hemline.motions import JOINT_NAMES

from .primitive_kernels import ROUND_CONE, primitive_distances
from .primitives import round_cone_shape
from .proxy import BodyProxy

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

_TRUNK = ("pelvis", "spine1", "spine2", "spine3")
_LIMBS = ("collar", "shoulder", "elbow", "wrist", "hip", "knee", "ankle")
_WITH = {"wrist": "hand", "ankle": "foot"}
_BULGE = 0.004
"""Depth [m] up to which skin of other parts may lie in a cone for free."""
_SCALE = 0.006
"""Residual [m] from which one counts less than squared."""


def fitted_cones(shaped: "ShapedBody") -> BodyProxy:
    """One rounded cone a part: limbs along their bones, the trunk in a left, a right and a middle row."""
    joints, cones, names = [], [], []
    vertices = np.asarray(shaped.vertices, np.float64)
    owner = shaped.body.weight_indices[:, 0]
    for name, part, side in _parts():
        mine = np.isin(owner, [JOINT_NAMES.index(each) for each in part])
        if side != 0:
            mine &= side * vertices[:, 0] > -0.01
        joints.append(JOINT_NAMES.index(part[0]))
        cones.append(_fitted_cone(vertices, mine))
        names.append(name)
    shapes = np.array([round_cone_shape(cone[:3], cone[3:6], cone[6], cone[7])[1] for cone in cones])
    kinds = np.full(len(cones), ROUND_CONE, np.int32)
    return BodyProxy(kinds, np.array(joints, np.int32), shapes, np.asarray(shaped.joints, np.float64), tuple(names))


def _parts() -> list[tuple[str, tuple[str, ...], int]]:
    """Name, joints that own its skin, side (0: both) of each primitive."""
    parts = [(f"{name} {word}", (name,), side) for name in _TRUNK for word, side in (("left", 1), ("right", -1))]
    parts += [("neck", ("neck",), 0), ("head", ("head",), 0)]
    for side in ("left", "right"):
        for limb in _LIMBS:
            part = tuple(f"{side}_{each}" for each in (limb, _WITH.get(limb)) if each)
            parts.append((f"{side} {limb}", part, 0))
    return parts


def _fitted_cone(vertices: Points, mine: np.ndarray) -> Float[np.ndarray, "8"]:
    """Least squares of the distances of its own skin, and of other skin where it lies too deep inside."""
    from scipy.optimize import least_squares

    own = vertices[mine]
    own = own[:: max(1, len(own) // 400)]
    low, high = own.min(0) - 0.05, own.max(0) + 0.05
    others = vertices[~mine & ((vertices > low) & (vertices < high)).all(1)]
    others = others[:: max(1, len(others) // 400)]
    points = np.concatenate([own, others])
    distances, gradients = np.empty(len(points)), np.empty((len(points), 3))
    shape = np.zeros((1, 16))

    def residuals(cone: np.ndarray) -> np.ndarray:
        shape[0, :6], shape[0, 6:8] = cone[:6], np.maximum(cone[6:8], 0.005)
        primitive_distances(ROUND_CONE, shape, 0, points, distances, gradients)
        return np.concatenate([distances[: len(own)], np.minimum(distances[len(own) :] + _BULGE, 0.0)])

    start = _axis_cone(own)
    found = least_squares(
        residuals, start, loss="soft_l1", f_scale=_SCALE, max_nfev=60, x_scale=np.abs(start).clip(0.02)
    ).x
    found[6:8] = np.maximum(found[6:8], 0.005)
    return found


def _axis_cone(points: Points) -> Float[np.ndarray, "8"]:
    """A first cone: the longest axis of the points, and their mean distance from it at either end."""
    centre = points.mean(0)
    axis = np.linalg.svd(points - centre, full_matrices=False)[2][0]
    along = (points - centre) @ axis
    away = np.linalg.norm(points - centre - along[:, None] * axis, axis=1)
    first, second = away[along < 0].mean(), away[along >= 0].mean()
    low, high = along.min() + first * 0.7, along.max() - second * 0.7
    if high <= low:
        low = high = (low + high) / 2
    return np.concatenate([centre + low * axis, centre + high * axis, [first, second]])
