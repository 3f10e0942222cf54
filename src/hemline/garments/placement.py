"""Whether a garment that was read is on its body, and outside of it."""

import numpy as np

from hemline.arrays import Vertices
from hemline.errors import BadGarment
from hemline.meshes import ClosestTree

from .clearance import cleared
from .dressing import CLEARANCE

_DEEPEST = 0.05
_INSIDE_SHARE = 0.3
_SAMPLE = 1000
_CURE = "place it on the body at rest (y up, facing +z, the origin at the pelvis or on the floor)"


def on_body(vertices: Vertices, tree: ClosestTree, origin: str | None, name: str) -> tuple[Vertices, tuple[str, ...]]:
    """Positions with the pelvis as origin, and a note where that was guessed.

    Args:
        vertices: Positions in the garment's own world [m].
        tree: The body at rest, the pelvis at the origin.
        origin: `pelvis`: as they are; `floor`: the origin lies between the soles; None: whichever is nearer to the
            skin by a third.
        name: How errors call the garment.

    Raises:
        BadGarment: No vertex is within 20 cm of the body.
    """
    lifted = vertices + (0, float(tree.vertices[:, 1].min()), 0)
    some = slice(None, None, max(1, len(vertices) // _SAMPLE))
    here, there = (tree.closest(each[some]).distances for each in (vertices, lifted))
    on_floor = origin == "floor" or (origin is None and there.mean() < 0.67 * here.mean())
    result, distances = (lifted, there) if on_floor else (vertices, here)
    if distances.min() > 0.2:
        got = f"{distances.min():.2f} m from it at the nearest, centre at {np.round(result.mean(axis=0), 2).tolist()}"
        raise BadGarment(f"{name} must be on the body", got, _CURE)
    guessed = bool(on_floor) and origin is None
    return result, ("origin: on the floor, as that brings it nearer to the skin",) * guessed


def outside_body(vertices: Vertices, tree: ClosestTree, name: str) -> tuple[Vertices, tuple[str, ...]]:
    """Positions moved out of the body, and a note that says how many.

    Args:
        vertices: Positions [m].
        tree: The body at rest.
        name: How errors call the garment.

    Raises:
        BadGarment: More than 30 % of the vertices are inside, or one is deeper than 5 cm.
    """
    distance = tree.signed_distances(vertices)
    inside, deepest = distance < 0, max(0.0, -1000 * float(distance.min()))
    if inside.mean() > _INSIDE_SHARE or deepest > 1000 * _DEEPEST:
        got = f"{inside.sum()} of {len(inside)} vertices inside it, the deepest {deepest:.0f} mm"
        raise BadGarment(f"{name} must fit the body at rest", got, f"{_CURE}, or name the body it was made on")
    close = distance < CLEARANCE
    if not close.any():
        return vertices.copy(), ()
    note = (
        f"{inside.sum()} vertices were inside the body at rest, the deepest {deepest:.1f} mm; "
        f"{close.sum()} were moved to {1000 * CLEARANCE:.0f} mm outside"
    )
    return cleared(vertices, tree, CLEARANCE), (note,)
