"""Fills a body with balls that move with its skin, to find cheaply where limbs overlap."""

import functools
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from hemline.arrays import Points
from hemline.bodies.model import INFLUENCES
from hemline.bodies.shape import BodyShape
from hemline.meshes import face_areas
from hemline.motions import JOINT_NAMES

from .parts import PART_ROOTS, at_crease, closed_parts, part_of_vertex

BALLS_OF_PART = {"pelvis": 90, "shoulder": 10, "elbow": 28, "hip": 14, "knee": 28}
"""Number of balls in each part, by the joint that the part hangs from."""

_LIMB_OF_PART = np.array([0, 1, 1, 2, 2, 3, 3, 4, 4])
_COVER_DISTANCE = 0.006
"""A ball covers the vertices that are less than this above it [m]."""
_CANDIDATES = 300
"""Number of largest balls that are considered in each part."""

_LEAST_GAP = 0.005
"""Balls of two limbs that are nearer than this at rest are never tested against each other [m]."""


@dataclass(frozen=True, eq=False)
class Balls:
    """Balls inside a shaped body at rest, each touching the skin from within.

    Attributes:
        centres: Centres at rest [m].
        radii: Radii [m].
        weight_indices: Joints that move each ball.
        weights: Weights of these joints.
        pairs: Pairs of balls of different limbs that may overlap.
        limb_pairs: Number of the pair of limbs that each pair belongs to.
    """

    centres: Points
    radii: Float[np.ndarray, " balls"]
    weight_indices: Int[np.ndarray, "balls influences"]
    weights: Float[np.ndarray, "balls influences"]
    pairs: Int[np.ndarray, "pairs 2"]
    limb_pairs: Int[np.ndarray, " pairs"]


@functools.lru_cache(maxsize=8)
def fill_with_balls(shaped: BodyShape) -> Balls:
    """Fills a body with balls, part by part: among many largest balls, those that cover the most skin are chosen.

    Args:
        shaped: The body.

    Source: Ma, Bae, Choi, "3D medial axis point approximation using nearest neighbors and the normal field",
        2012 (the largest ball at a point, by shrinking).
    """
    part, areas = part_of_vertex(shaped.body), _vertex_areas(shaped)
    chosen = []
    for index, root in enumerate(PART_ROOTS):
        own = np.flatnonzero(part == index)
        tried = own[_sample_by_area(areas[own], _CANDIDATES)]
        count = BALLS_OF_PART[root.split("_")[-1]]
        chosen.append(_cover(shaped.vertices[own], areas[own], tried, *_largest_balls(shaped, tried), count))
    first, second, centres, radii = (np.concatenate(each) for each in zip(*chosen, strict=True))
    indices, weights = _mean_weights(shaped, first, second)
    pairs, limb_pairs = _pairs(shaped, centres, radii, part[first])
    return Balls(centres.astype(np.float32), radii.astype(np.float32), indices, weights, pairs, limb_pairs)


def _vertex_areas(shaped: BodyShape) -> np.ndarray:
    areas = face_areas(shaped.vertices, shaped.body.faces)
    return np.bincount(shaped.body.faces.ravel(), np.repeat(areas, 3), len(shaped.vertices)) / 3


def _sample_by_area(areas: np.ndarray, count: int) -> np.ndarray:
    """Returns about `count` indices, in proportion to the area of the skin."""
    fractions = np.cumsum(areas) / areas.sum()
    return np.unique(np.minimum(np.searchsorted(fractions, (np.arange(count) + 0.5) / count), len(areas) - 1))


def _largest_balls(shaped: BodyShape, at: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns the largest inner ball at each given vertex: another vertex that it touches, its centre, its radius."""
    from scipy.spatial import KDTree

    vertices = shaped.vertices.astype(np.float64)
    points, normals = vertices[at], shaped.normals[at].astype(np.float64)
    tree, radii = KDTree(vertices), np.full(len(at), 0.2)
    other, active = at.copy(), np.arange(len(at))
    for _ in range(12):
        distance, nearest = tree.query(points[active] - radii[active, None] * normals[active])
        shrinks = distance < radii[active] - 1e-4
        active, nearest = active[shrinks], np.asarray(nearest)[shrinks]
        apart = points[active] - vertices[nearest]
        along = np.maximum(np.einsum("pc,pc->p", apart, normals[active]), 1e-6)
        radii[active] = np.minimum(radii[active], np.einsum("pc,pc->p", apart, apart) / (2 * along))
        other[active] = nearest
    return other, points - radii[:, None] * normals, radii


def _cover(
    points: np.ndarray,
    areas: np.ndarray,
    touching: np.ndarray,
    other: np.ndarray,
    centres: np.ndarray,
    radii: np.ndarray,
    count: int,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Chooses balls greedily, so that they cover the largest area of skin."""
    distances = np.linalg.norm(centres[:, None] - points[None], axis=2)
    covers = (distances < radii[:, None] + _COVER_DISTANCE).astype(np.float32)
    uncovered, chosen = areas.astype(np.float32), []
    for _ in range(count):
        chosen.append(int(np.argmax(covers @ uncovered)))
        uncovered *= 1 - covers[chosen[-1]]
    return touching[chosen], other[chosen], centres[chosen], radii[chosen]


def _mean_weights(shaped: BodyShape, first: np.ndarray, second: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns skin weights of balls: the mean over the two vertices that each touches, strongest first."""
    body = shaped.body
    dense = np.zeros((len(first), len(JOINT_NAMES)))
    for vertices in (first, second):
        np.add.at(dense, (np.arange(len(first))[:, None], body.weight_indices[vertices]), body.weights[vertices] / 2)
    order = np.argsort(-dense, axis=1, kind="stable")[:, :INFLUENCES]
    largest = np.take_along_axis(dense, order, axis=1)
    return order.astype(np.int32), (largest / largest.sum(axis=1, keepdims=True)).astype(np.float32)


def _pairs(
    shaped: BodyShape, centres: np.ndarray, radii: np.ndarray, part: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Returns pairs of balls of different limbs, without those at the crease between them or touching at rest."""
    limb = _LIMB_OF_PART[part]
    first, second = np.nonzero(limb[:, None] < limb[None, :])
    apart = np.linalg.norm(centres[first] - centres[second], axis=1) - radii[first] - radii[second]
    near = _near_own_crease(shaped, centres)  # (limbs, balls)
    on_torso = near[limb[second], first] | near[limb[second], second]
    between_legs = near[limb[first], first] & near[limb[second], second]
    kept = (apart > _LEAST_GAP) & ~np.where(limb[first] == 0, on_torso, between_legs)
    _, numbers = np.unique(len(near) * limb[first[kept]] + limb[second[kept]], return_inverse=True)
    pairs = np.column_stack([first[kept], second[kept]])
    return pairs.astype(np.int32), numbers.astype(np.int32)


def _near_own_crease(shaped: BodyShape, centres: np.ndarray) -> np.ndarray:
    """Returns which balls lie at the crease between each limb and the torso; none for the torso itself."""
    near, rims = np.zeros((1 + max(_LIMB_OF_PART), len(centres)), dtype=bool), closed_parts(shaped.body)[0].rims
    middles = np.array([shaped.vertices[rim].mean(axis=0) for rim in rims])
    for limb, root in enumerate(("left_shoulder", "right_shoulder", "left_hip", "right_hip"), start=1):
        joint = shaped.joints[JOINT_NAMES.index(root)]
        rim = rims[int(np.argmin(np.linalg.norm(middles - joint, axis=1)))]
        near[limb] = at_crease(shaped.vertices, rim, centres)
    return near
