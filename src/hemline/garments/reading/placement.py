"""Places a garment from a file on its body, and moves its vertices out of the body."""

from typing import NamedTuple

import numpy as np

from hemline.arrays import Vertices
from hemline.errors import OffBody
from hemline.garments.clearance import push_out_of_body
from hemline.garments.dressing import CLEARANCE
from hemline.meshes import ClosestTree

from .units import UP_GUESS_RATIO, Z_UP_NOTE, to_y_up

_FARTHEST = 0.2
_DEEPEST = 0.05
_INSIDE_FRACTION = 0.3
_SAMPLES = 1000
_CURE = (
    "place it on the body at rest (y up, facing +z, the origin at the pelvis or on the floor), "
    "or have it tried on (hemline tryon)"
)


class PlacedVertices(NamedTuple):
    """Positions of a garment in the world of the body at rest."""

    vertices: Vertices
    """Positions, float64 [m]."""
    notes: tuple[str, ...]
    """What was guessed or changed, one sentence each."""


def place_on_body(
    vertices: Vertices, tree: ClosestTree, name: str, *, up: str | None, origin: str | None
) -> PlacedVertices | OffBody:
    """Moves a garment into the world of the body: y up, the pelvis at the origin.

    Args:
        vertices: Positions in the garment's own world [m].
        tree: Surface of the body at rest, the pelvis at the origin.
        name: Name of the garment in error messages.
        up: The axis that points up, y or z. None guesses: z if the garment fits the body that way and either does not
            fit with y up, or is then farther from the skin by half; else y.
        origin: `pelvis` leaves positions as they are; `floor` takes the origin to lie between the soles; None takes
            the floor where that brings the garment nearer to the skin by a third.

    Returns:
        The positions; or, if no vertex comes within 20 cm of the body, the error that says so.
    """
    placement, turned = _place(to_y_up(vertices, up or "y"), tree, origin), False
    if up is None:
        other = _place(to_y_up(vertices, "z"), tree, origin)
        turned = other.fits and (not placement.fits or other.distance < UP_GUESS_RATIO * placement.distance)
        placement = other if turned else placement
    if placement.nearest > _FARTHEST:
        where = np.round(placement.vertices.mean(axis=0), 2).tolist()
        got = f"{placement.nearest:.2f} m from it at the nearest, centre at {where}"
        return OffBody(f"{name} must be on the body", got, _CURE)
    notes = (Z_UP_NOTE,) * turned
    if placement.on_floor and origin is None:
        notes += ("origin: on the floor, as that brings it nearer to the skin",)
    return PlacedVertices(placement.vertices, notes)


class _TriedPlacement(NamedTuple):
    """A garment at one place, and how well it fits the body there."""

    vertices: Vertices
    on_floor: bool
    nearest: float
    """Distance of the nearest vertex from the skin [m]."""
    distance: float
    """Mean distance of the vertices from the skin [m]."""
    fits: bool


def _place(vertices: Vertices, tree: ClosestTree, origin: str | None) -> _TriedPlacement:
    """Puts a garment with y up at the better one of its possible origins."""
    lifted = vertices + (0, float(tree.vertices[:, 1].min()), 0)
    some = slice(None, None, max(1, len(vertices) // _SAMPLES))
    at_pelvis, at_floor = (tree.signed_distances(each[some]) for each in (vertices, lifted))
    on_floor = origin == "floor" or (origin is None and np.abs(at_floor).mean() < 0.67 * np.abs(at_pelvis).mean())
    signed = at_floor if on_floor else at_pelvis
    distances = np.abs(signed)
    fits = distances.min() <= _FARTHEST and not _is_too_deep(signed)
    placed = lifted if on_floor else vertices
    return _TriedPlacement(placed, bool(on_floor), float(distances.min()), float(distances.mean()), bool(fits))


def _is_too_deep(distances: np.ndarray) -> bool:
    return (distances < 0).mean() > _INSIDE_FRACTION or distances.min() < -_DEEPEST


def move_outside_body(vertices: Vertices, tree: ClosestTree, name: str) -> PlacedVertices | OffBody:
    """Moves the vertices of a garment that are inside the body, or too close to it, outside.

    Args:
        vertices: Positions [m].
        tree: Surface of the body at rest.
        name: Name of the garment in error messages.

    Returns:
        The positions, with a note that counts what was moved; or, if more than 30 % of the vertices are inside or one
        is deeper than 5 cm, the error that says so.
    """
    distance = tree.signed_distances(vertices)
    inside, deepest = distance < 0, max(0.0, -1000 * float(distance.min()))
    if _is_too_deep(distance):
        got = f"{inside.sum()} of {len(inside)} vertices inside it, the deepest {deepest:.0f} mm"
        return OffBody(f"{name} must fit the body at rest", got, f"{_CURE}, or name the body it was made on")
    close = distance < CLEARANCE
    if not close.any():
        return PlacedVertices(vertices.copy(), ())
    moved = f"{close.sum()} were moved to {1000 * CLEARANCE:.0f} mm outside"
    note = (
        f"{inside.sum()} vertices were inside the body at rest, the deepest {deepest:.1f} mm; {moved}"
        if inside.any()
        else f"vertices closer to the body at rest: {moved}"
    )
    return PlacedVertices(push_out_of_body(vertices, tree, CLEARANCE), (note,))
