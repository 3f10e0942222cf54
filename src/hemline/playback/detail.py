"""Levels of detail: the garment and body of a level, its error, and the level for a viewing distance."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from hemline.animators.base import Animator, Detailed, Level
from hemline.bodies import ShapedBody, coarser_body
from hemline.errors import BadInput
from hemline.garments import Garment, Pins
from hemline.meshes import ClosestTree

DETAILS = (1.0, 0.5, 0.25, 0.1)
"""Levels that are measured and used in examples."""
FULL_BODY_DETAIL = 0.5
"""Least detail at which cloth is kept out of the full body; below it, a coarser body around it is used."""
LEAST_BODY_DETAIL = 0.2
"""Least fraction of the body's vertices; a tenth would let cloth 7 mm deep into the full body."""
ERROR_PERCENTILE = 99.0
"""Percentile of the vertex error used as the error of a level."""


@dataclass(frozen=True, eq=False)
class LevelOnBody:
    """One level of an animator on a body."""

    animator: Animator
    """The animator at this level."""
    garment: Garment
    """The garment that is shown, pinned to `body`."""
    body: ShapedBody
    """The body that cloth is kept out of: the full body, or a coarser one around it."""
    error: float
    """99th percentile of the distance between the vertices of the full garment at rest and this level [m]."""


def level_on_body(
    animator: Animator, body: ShapedBody, detail: float, *, known: ShapedBody | None = None
) -> LevelOnBody:
    """Puts a level of an animator on a body.

    Args:
        animator: A fitted animator, full or at any level.
        body: The full body.
        known: The body as the animator knows it; None: `body`.
        detail: Fraction of the garment's vertices, above 0 and at most 1.

    Raises:
        BadInput: `detail` is out of its range or leaves too few vertices, or the animator has no levels.
    """
    level = level_of(animator, detail)
    if not isinstance(level, Level):
        return LevelOnBody(level, level.garment, body, 0.0)
    collider = body if detail >= FULL_BODY_DETAIL else coarser_body(body, max(detail, LEAST_BODY_DETAIL))
    return LevelOnBody(level, _bind_pins(level.garment, body, collider), collider, _error(level, known or body))


def level_of(animator: Animator, detail: float) -> Animator:
    """Returns an animator at a level of detail.

    Args:
        animator: A fitted animator, full or at any level.
        detail: See `level_on_body`.

    Raises:
        BadInput: See `level_on_body`.
    """
    if not 0 < detail <= 1:
        raise BadInput("a level of detail is above 0 and at most 1", f"detail = {detail}", "use 1, 0.5, 0.25 or 0.1")
    if isinstance(animator, Detailed):
        return animator.at_detail(detail)
    if detail == 1:
        return animator
    raise BadInput(f"animator '{animator.name}' has no levels of detail", f"detail = {detail}", "play it at 1")


def pixels_of(
    error: float, distance: float, *, height_px: int = 1080, field_of_view: float = math.radians(60)
) -> float:
    r"""Returns the size of a distance in the world on the screen [pixels]: $e\,h / (2 d \tan(\alpha / 2))$.

    Args:
        error: The distance in the world, such as `Player.error` [m].
        distance: Distance from the camera [m].
        height_px: Height of the picture [pixels].
        field_of_view: Vertical angle of the camera [rad].

    Raises:
        BadInput: Distance or height is not above 0, or the angle is not between 0 and pi.
    """
    if not (distance > 0 and height_px > 0 and 0 < field_of_view < math.pi):
        got = f"distance = {distance} m, height_px = {height_px}, field_of_view = {field_of_view}"
        raise BadInput("a camera sees at a distance, with a height and an angle below pi", got, "give positive numbers")
    return error * height_px / (2 * distance * math.tan(field_of_view / 2))


def detail_for(
    distance: float,
    errors: Mapping[float, float],
    *,
    pixels: float = 0.5,
    height_px: int = 1080,
    field_of_view: float = math.radians(60),
) -> float:
    """Returns the coarsest level whose error is invisible at a distance.

    Args:
        distance: Distance from the camera [m].
        errors: Error of each level by its detail, such as `Player.error` [m].
        pixels: Largest error that is accepted on the screen [pixels].
        height_px: See `pixels_of`.
        field_of_view: See `pixels_of` [rad].

    Returns:
        The detail of that level, or of the finest one where all are too coarse.

    Raises:
        BadInput: There is no level; or see `pixels_of`.
    """
    if not errors:
        raise BadInput("a level is chosen from some", "none", "give errors such as {1.0: 0.0, 0.25: 0.004}")
    on_screen = {
        detail: pixels_of(error, distance, height_px=height_px, field_of_view=field_of_view)
        for detail, error in errors.items()
    }
    return min((detail for detail in on_screen if on_screen[detail] <= pixels), default=max(on_screen))


def _bind_pins(garment: Garment, body: ShapedBody, collider: ShapedBody) -> Garment:
    """Returns the garment with its pins on the skin bound to a coarser body, at the same positions at rest."""
    pins = garment.pins
    skin = pins.joints < 0
    if collider is body or not skin.any():
        return garment
    places = pins.positions(body.vertices, body.normals, body.body.faces, body.joints)
    tree = ClosestTree(collider.vertices.astype(np.float64), collider.body.faces)
    bound = Pins.bind(pins.vertices[skin], places[skin], tree, collider.normals)
    faces, weights, heights = pins.body_faces.copy(), pins.barycentric.copy(), pins.heights.copy()
    faces[skin], weights[skin], heights[skin] = bound.body_faces, bound.barycentric, bound.heights
    faces[~skin] = 0
    return replace(garment, pins=replace(pins, body_faces=faces, barycentric=weights, heights=heights))


def _error(level: Level, body: ShapedBody) -> float:
    posed = body.posed(body.rest_pose)
    full = level.full
    vertices = full.step(full.start(posed), posed, 1 / 30)[1].astype(np.float64)
    tree = ClosestTree(vertices[level.vertex_ids], level.garment.faces)
    return float(np.percentile(tree.closest(vertices).distances, ERROR_PERCENTILE))
