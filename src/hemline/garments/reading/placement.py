"""Whether a garment that was read is on its body, and outside of it."""

from typing import NamedTuple

import numpy as np

from hemline.arrays import Vertices
from hemline.errors import OffBody
from hemline.garments.clearance import push_out_of_body
from hemline.garments.dressing import CLEARANCE
from hemline.meshes import ClosestTree

from .up_axis import BETTER, TURNED, stood_up

_FARTHEST = 0.2
_DEEPEST = 0.05
_INSIDE_SHARE = 0.3
_SAMPLE = 1000
_CURE = (
    "place it on the body at rest (y up, facing +z, the origin at the pelvis or on the floor), "
    "or have it tried on (hemline tryon)"
)


def on_body(
    vertices: Vertices, tree: ClosestTree, name: str, *, up: str | None, origin: str | None
) -> tuple[Vertices, tuple[str, ...]]:
    """Positions with y up and the pelvis as origin, and notes where that was guessed.

    Args:
        vertices: Positions in the garment's own world [m].
        tree: The body at rest, the pelvis at the origin.
        name: How errors call the garment.
        up: The axis that points up, y or z; None: z if the garment fits the body so, and with y up it does not or is
            farther from the skin by half; else y.
        origin: `pelvis`: as they are; `floor`: the origin lies between the soles; None: whichever is nearer to the
            skin by a third.

    Raises:
        OffBody: No vertex is within 20 cm of the body.
    """
    result, turned = _laid(stood_up(vertices, up or "y"), tree, origin), False
    if up is None:
        other = _laid(stood_up(vertices, "z"), tree, origin)
        turned = other.fits and (not result.fits or other.away < BETTER * result.away)
        result = other if turned else result
    if result.nearest > _FARTHEST:
        where = np.round(result.vertices.mean(axis=0), 2).tolist()
        raise OffBody(
            f"{name} must be on the body", f"{result.nearest:.2f} m from it at the nearest, centre at {where}", _CURE
        )
    notes = (TURNED,) * turned
    if result.on_floor and origin is None:
        notes += ("origin: on the floor, as that brings it nearer to the skin",)
    return result.vertices, notes


class _Laid(NamedTuple):
    vertices: Vertices
    on_floor: bool
    nearest: float
    away: float
    fits: bool


def _laid(vertices: Vertices, tree: ClosestTree, origin: str | None) -> _Laid:
    """A garment with y up at the better of its possible origins."""
    lifted = vertices + (0, float(tree.vertices[:, 1].min()), 0)
    some = slice(None, None, max(1, len(vertices) // _SAMPLE))
    here, there = (tree.signed_distances(each[some]) for each in (vertices, lifted))
    on_floor = origin == "floor" or (origin is None and np.abs(there).mean() < 0.67 * np.abs(here).mean())
    distances = there if on_floor else here
    away = np.abs(distances)
    fits = away.min() <= _FARTHEST and not _too_deep(distances)
    return _Laid(lifted if on_floor else vertices, bool(on_floor), float(away.min()), float(away.mean()), bool(fits))


def _too_deep(distances: np.ndarray) -> bool:
    return (distances < 0).mean() > _INSIDE_SHARE or distances.min() < -_DEEPEST


def outside_body(vertices: Vertices, tree: ClosestTree, name: str) -> tuple[Vertices, tuple[str, ...]]:
    """Positions moved out of the body, and a note that says how many.

    Args:
        vertices: Positions [m].
        tree: The body at rest.
        name: How errors call the garment.

    Raises:
        OffBody: More than 30 % of the vertices are inside, or one is deeper than 5 cm.
    """
    distance = tree.signed_distances(vertices)
    inside, deepest = distance < 0, max(0.0, -1000 * float(distance.min()))
    if _too_deep(distance):
        got = f"{inside.sum()} of {len(inside)} vertices inside it, the deepest {deepest:.0f} mm"
        raise OffBody(f"{name} must fit the body at rest", got, f"{_CURE}, or name the body it was made on")
    close = distance < CLEARANCE
    if not close.any():
        return vertices.copy(), ()
    note = (
        f"{inside.sum()} vertices were inside the body at rest, the deepest {deepest:.1f} mm; "
        f"{close.sum()} were moved to {1000 * CLEARANCE:.0f} mm outside"
    )
    return push_out_of_body(vertices, tree, CLEARANCE), (note,)
