"""Fit rounded cones to the parts of a body at rest."""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hemline.arrays import Float, Int, Points
from hemline.motions import JOINT_NAMES

from .distances import round_cone_shape
from .primitive_kernels import ROUND_CONE, primitive_distances

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

_TRUNK = ("pelvis", "spine1", "spine2", "spine3")
_LIMBS = ("collar", "shoulder", "elbow", "wrist", "hand", "hip", "knee", "ankle")
_WITH = {"ankle": "foot"}
_OWNED = 0.35
"""Skin weight from which skin belongs to a part."""
_FEWEST = 12
"""Vertices of a part that has a cone."""
_MIRROR = np.array([-1.0, 1.0, 1.0])
_FREE = (0.012, 0.03, 0.06)
"""Heights [m] above the skin at which there is air, which no cone should fill."""
_THINNEST, _THICKEST = [0.008, 0.008], [0.2, 0.2]
"""Bounds of the radii [m]."""
_SCALE = 0.006
"""Residual [m] from which one counts less than squared."""


class FittedCones(NamedTuple):
    """Rounded cones in a body's rest pose."""

    joints: Int[np.ndarray, " cones"]
    """Joint that carries each; int32."""
    shapes: Float[np.ndarray, "cones 16"]
    """Their numbers, as `primitive_kernels` lists them; float64 [m]."""
    names: tuple[str, ...]
    """The part that each stands for."""


def fit_cones(shaped: "ShapedBody") -> FittedCones:
    """One rounded cone a part: limbs along their bones, the trunk in two columns; both sides are fitted as one.

    Parts that hardly any skin follows, as of a rig without collars, have none.
    """
    vertices, air = np.asarray(shaped.vertices, np.float64), _air(shaped)
    weights, used = shaped.body.weights, shaped.body.weight_indices

    def owned(part: list[int]) -> np.ndarray:
        return np.where(np.isin(used, part), weights, 0.0).sum(1) >= _OWNED

    joints, cones, names = [], [], []
    for name, part in _middle_parts():
        if (own := vertices[owned(part)]).shape[0] < _FEWEST:
            continue
        joints.append(part[0])
        cones.append(_fit_cone(own, air))
        names.append(name)
    for name, left, right in _side_parts():
        other = vertices[owned(right) & (vertices[:, 0] < 0.01)] * _MIRROR
        own = np.concatenate([vertices[owned(left) & (vertices[:, 0] > -0.01)], other])
        if len(own) < _FEWEST:
            continue
        cone = _fit_cone(own, air)
        joints += [left[0], right[0]]
        cones += [cone, cone * [*_MIRROR, *_MIRROR, 1, 1]]
        names += [f"left {name}", f"right {name}"]
    shapes = np.array([round_cone_shape(cone[:3], cone[3:6], cone[6], cone[7])[1] for cone in cones])
    return FittedCones(np.array(joints, np.int32), shapes, tuple(names))


def _middle_parts() -> list[tuple[str, list[int]]]:
    """Name, and joints that own the skin, of the parts that there is one of."""
    return [(name, [JOINT_NAMES.index(name)]) for name in ("neck", "head")]


def _side_parts() -> list[tuple[str, list[int], list[int]]]:
    """Name, and joints that own the skin on the left and on the right, of the parts that there are two of."""
    parts = [(name, [JOINT_NAMES.index(name)], [JOINT_NAMES.index(name)]) for name in _TRUNK]
    for limb in _LIMBS:
        used = [each for each in (limb, _WITH.get(limb)) if each]
        left, right = ([JOINT_NAMES.index(f"{side}_{each}") for each in used] for side in ("left", "right"))
        parts.append((limb, left, right))
    return parts


def _air(shaped: "ShapedBody") -> Points:
    """Points above the skin that are as far from all of it as they are high."""
    from scipy.spatial import KDTree

    vertices, normals = np.asarray(shaped.vertices, np.float64)[::3], np.asarray(shaped.normals, np.float64)[::3]
    tree = KDTree(shaped.vertices)
    above = np.concatenate([vertices + height * normals for height in _FREE])
    return above[tree.query(above)[0] > 0.9 * np.repeat(_FREE, len(vertices))]


def _fit_cone(own: Points, air: Float[np.ndarray, "air 3"]) -> Float[np.ndarray, "8"]:
    """Least squares of the distances of its own skin, and of the air that it fills."""
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
        primitive_distances(ROUND_CONE, shape, 0, points, distances, gradients)
        return np.concatenate([distances[: len(own)], np.minimum(distances[len(own) :], 0.0)])

    # the axis stays within the part: a cone that is only seen from its side has no length of its own
    low, high = np.append(own.min(0), own.min(0)), np.append(own.max(0), own.max(0))
    bounds = np.append(low, _THINNEST), np.append(high, _THICKEST)
    start = np.clip(_axis_cone(own), bounds[0] + 1e-4, bounds[1] - 1e-4)
    scale = np.append(np.full(6, 0.1), [0.05, 0.05])
    return least_squares(residuals, start, bounds=bounds, loss="soft_l1", f_scale=_SCALE, max_nfev=60, x_scale=scale).x


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
