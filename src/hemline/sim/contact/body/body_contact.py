"""Contact during one step: which point of the moving body each vertex is held off from."""

from copy import copy

import numpy as np
from jaxtyping import Bool, Float

from .planes import SkinPoints, Planes
from .surface import MovingSkin, BodySurface
from .touch_kernels import mark_strays, mark_turned_inside

SEARCH_AGAIN_DISTANCE = 0.001
"""The surface is looked for again under a vertex that has moved by this much [m]."""

WIDE_REACH = 3.0
"""How much farther than usual is looked for a body that comes fast."""


class Contact:
    """The contact planes of one step; found at its start, then where the cloth is.

    A plane found at the step's start moves with the body's surface, so it lies on the side that the cloth comes from,
    however far the body moves in the step. Later searches must not change that side while the vertex is inside: the
    nearest surface may then be the far one of a hand or a foot.

    Args:
        surface: The body's mesh.
        then: It at the step's start.
        now: It at the step's end.
        start: The cloth at the step's start [m].
        guess: Where the cloth is taken to go without contact [m].
        fixed: Vertices without contact.
        stiffness: Of each vertex in contact [N/m].
        known: Closest points of an earlier step; they speed the search and do not change its result.
    """

    def __init__(
        self,
        surface: BodySurface,
        then: MovingSkin,
        now: MovingSkin,
        start: Float[np.ndarray, "verts 3"],
        guess: Float[np.ndarray, "verts 3"],
        fixed: Bool[np.ndarray, " verts"],
        stiffness: Float[np.ndarray, " verts"],
        known: SkinPoints | None = None,
    ):
        self.surface, self.then, self.now = surface, then, now
        self.start, self.fixed, self.stiffness = start, fixed, stiffness
        closest = surface.closest(start, then, fixed, known)
        self.ahead, self._sought = surface.closest(guess, now, fixed, closest), guess.copy()
        surprised = (closest.face < 0) & (self.ahead.face >= 0)
        if surprised.any():
            wide = surface.closest(start, then, ~surprised, reach=WIDE_REACH * surface.reach)
            closest = _chosen(surprised, wide, closest)
        self._begin(closest)

    def move(self, positions: Float[np.ndarray, "verts 3"]) -> bool:
        """Find the planes again, where the cloth is at the step's end; whether a vertex moved far enough for that."""
        if not self._sought_again(positions):
            return False
        planes, before = self.laid(self.ahead), self.planes
        kept = np.empty(len(positions), bool)
        mark_turned_inside(positions, before.normal, before.stiffness, planes.normal, planes.point, planes.stiffness, kept)
        self.places = _chosen(kept, self.places, self.ahead)
        self.planes = _chosen(kept, self.planes, planes)
        return True

    def _begin(self, closest: SkinPoints) -> None:
        """Lay the planes at the closest places to the cloth at the step's start."""
        self.places, self.planes = closest, self.laid(closest)

    def _sought_again(self, positions: Float[np.ndarray, "verts 3"]) -> bool:
        """Look for the closest places where vertices have moved; whether any has."""
        asked = np.empty(len(positions), bool)
        if not mark_strays(positions, self.fixed, SEARCH_AGAIN_DISTANCE, self._sought, asked):
            return False
        self.ahead = self.surface.closest(positions, self.now, self.fixed, self.ahead, asked=asked)
        return True

    def of(self, which: Bool[np.ndarray, " verts"]) -> "Contact":
        """That of some of the vertices."""
        part = copy(self)
        part.start, part.fixed, part.stiffness = self.start[which], self.fixed[which], self.stiffness[which]
        part._sought = self._sought[which]
        part.places, part.ahead, part.planes = (_rows(each, which) for each in (self.places, self.ahead, self.planes))
        return part

    def laid(self, closest: SkinPoints) -> Planes:
        """The planes at those places."""
        return self.surface.planes(closest, self.start, self.then, self.now, self.stiffness)


def _rows(of, which: Bool[np.ndarray, " verts"]):
    """Rows of places or planes."""
    return type(of)(*(each[which] for each in of))


def _chosen(which: Bool[np.ndarray, " verts"], first, second):
    """Rows of the first where `which`, else of the second, array by array."""
    if not which.any():
        return second
    columns = which[:, None]
    pairs = zip(first, second, strict=True)
    return type(second)(*(np.where(which if a.ndim == 1 else columns, a, b) for a, b in pairs))
