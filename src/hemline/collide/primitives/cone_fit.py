"""Fits rounded cones to the parts of a body at rest."""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hemline.arrays import Float, Int, Points
from hemline.motions import JOINT_NAMES

from .distances import round_cone_shape
from .primitive_kernels import round_cone_distances

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

_TRUNK = ("pelvis", "spine1", "spine2", "spine3")
_LIMBS = ("collar", "shoulder", "elbow", "wrist", "hand", "hip", "knee", "ankle")
_WITH = {"ankle": "foot"}
_OWNED = 0.35
"""Least skin weight at which a vertex belongs to a part."""
_FEWEST = 12
"""A part with fewer vertices has no cone."""
_MIRROR = np.array([-1.0, 1.0, 1.0])
_FREE = (0.012, 0.03, 0.06)
"""Heights above the skin at which air is sampled, which no cone should fill [m]."""
_THINNEST, _THICKEST = [0.008, 0.008], [0.2, 0.2]
"""Bounds of the radii [m]."""
_SCALE = 0.006
"""Residual above which the loss grows less than quadratically [m]."""


class FittedCones(NamedTuple):
    """Rounded cones in a body's rest pose."""

    joints: Int[np.ndarray, " cones"]
    """Joint that carries each cone; int32."""
    shapes: Float[np.ndarray, "cones 16"]
    """Numbers of each cone, as `primitive_kernels` lists them; float64 [m]."""
    names: tuple[str, ...]
    """Body part that each cone stands for."""


def fit_cones(shaped: "ShapedBody") -> FittedCones:
    """Fits one rounded cone to each part; limbs on both sides are fitted as one, the trunk in two columns.

    Parts that hardly any skin follows, such as the collars of a rig without them, have no cone.
    """
    vertices, air = np.asarray(shaped.vertices, np.float64), _air(shaped)
    weights, used = shaped.body.weights, shaped.body.weight_indices

    def in_part(part: list[int]) -> np.ndarray:
        return np.where(np.isin(used, part), weights, 0.0).sum(1) >= _OWNED

    joints, cones, names = [], [], []
    for name, part in _middle_parts():
        if (own := vertices[in_part(part)]).shape[0] < _FEWEST:
            continue
        joints.append(part[0])
        cones.append(_fit_cone(own, air))
        names.append(name)
    for name, left, right in _side_parts():
        other = vertices[in_part(right) & (vertices[:, 0] < 0.01)] * _MIRROR
        own = np.concatenate([vertices[in_part(left) & (vertices[:, 0] > -0.01)], other])
        if len(own) < _FEWEST:
            continue
        cone = _fit_cone(own, air)
        joints += [left[0], right[0]]
        cones += [cone, cone * [*_MIRROR, *_MIRROR, 1, 1]]
        names += [f"left {name}", f"right {name}"]
    shapes = np.array([round_cone_shape(cone[:3], cone[3:6], cone[6], cone[7])[1] for cone in cones])
    return FittedCones(np.array(joints, np.int32), shapes, tuple(names))


def _middle_parts() -> list[tuple[str, list[int]]]:
    """Returns name and joints of each part that the body has once."""
    return [(name, [JOINT_NAMES.index(name)]) for name in ("neck", "head")]


def _side_parts() -> list[tuple[str, list[int], list[int]]]:
    """Returns name, joints on the left and joints on the right of each part that the body has twice."""
    parts = [(name, [JOINT_NAMES.index(name)], [JOINT_NAMES.index(name)]) for name in _TRUNK]
    for limb in _LIMBS:
        used = [each for each in (limb, _WITH.get(limb)) if each]
        left, right = ([JOINT_NAMES.index(f"{side}_{each}") for each in used] for side in ("left", "right"))
        parts.append((limb, left, right))
    return parts


def _air(shaped: "ShapedBody") -> Points:
    """Samples points above the skin whose nearest skin is right beneath them."""
    from scipy.spatial import KDTree

    vertices, normals = np.asarray(shaped.vertices, np.float64)[::3], np.asarray(shaped.normals, np.float64)[::3]
    tree = KDTree(shaped.vertices)
    above = np.concatenate([vertices + height * normals for height in _FREE])
    return above[tree.query(above)[0] > 0.9 * np.repeat(_FREE, len(vertices))]


def _fit_cone(own: Points, air: Float[np.ndarray, "air 3"]) -> Float[np.ndarray, "8"]:
    """Fits a cone by least squares of the distances of its own skin, and of the air that it fills."""
    from scipy.optimize import least_squares

    own = own[:: max(1, len(own) // 400)]
    low, high = own.min(0) - 0.1, own.max(0) + 0.1
    others = air[((air > low) & (air < high)).all(1)]
    others = others[:: max(1, len(others) // 800)]
    points = np.concatenate([own, others])
    distances, gradients = np.empty(len(points)), np.empty((len(points), 3))
    shape = np.zeros((1, 16))

    def residuals(cone: np.ndarray) -> np.ndarray:
        shape[0, :8] = cone
        round_cone_distances(shape, 0, points, distances, gradients)
        return np.concatenate([distances[: len(own)], np.minimum(distances[len(own) :], 0.0)])

    # the axis stays within the part: a cone that is only seen from its side has no length of its own
    low, high = np.append(own.min(0), own.min(0)), np.append(own.max(0), own.max(0))
    bounds = np.append(low, _THINNEST), np.append(high, _THICKEST)
    start = np.clip(_axis_cone(own), bounds[0] + 1e-4, bounds[1] - 1e-4)
    scale = np.append(np.full(6, 0.1), [0.05, 0.05])
    return least_squares(residuals, start, bounds=bounds, loss="soft_l1", f_scale=_SCALE, max_nfev=60, x_scale=scale).x


def _axis_cone(points: Points) -> Float[np.ndarray, "8"]:
    """Makes an initial cone: along the longest axis of the points, with their mean distance from it at either end."""
    centre = points.mean(0)
    axis = np.linalg.svd(points - centre, full_matrices=False)[2][0]
    along = (points - centre) @ axis
    away = np.linalg.norm(points - centre - along[:, None] * axis, axis=1)
    first, second = away[along < 0].mean(), away[along >= 0].mean()
    low, high = along.min() + first * 0.7, along.max() - second * 0.7
    if high <= low:
        low = high = (low + high) / 2
    return np.concatenate([centre + low * axis, centre + high * axis, [first, second]])
