"""Contact of cloth vertices with the skin during one step: the point of the moving body that holds each vertex off."""

from abc import ABC, abstractmethod
from copy import copy

import numpy as np
from jaxtyping import Bool, Float, Int

from hemline.sim.contact.pairs.pair_kernels import PairRows

from .planes import Planes, SkinPoints
from .surface import BodySurface, MovingSkin
from .touch_kernels import mark_strays, mark_turned_inside

SEARCH_AGAIN_DISTANCE = 0.001
"""The closest skin is searched for again under a vertex that has moved by this distance [m]."""

WIDE_REACH = 3.0
"""Factor on the search radius where the body comes close within the step but was out of reach at its start."""


class Contact(ABC):
    """The contact planes of one step. A subclass decides which place on the skin holds a vertex off.

    The constructor finds the skin closest to the cloth at both ends of the step. It calls no method that a subclass
    overrides: each subclass sets `places` and `planes` in its own constructor.

    Args:
        surface: Topology of the body's mesh.
        then: The skin at the start of the step.
        now: The skin at the end of the step.
        start: The cloth at the start of the step [m].
        guess: Predicted cloth at the end of the step, without contact [m].
        fixed: Vertices without contact.
        stiffness: Contact stiffness of each vertex [N/m].
        known: Closest points of an earlier step; they speed up the search and do not change its result.

    Attributes:
        closest_at_start: Closest skin of each vertex at the start of the step.
        ahead: Closest skin of each vertex at the end of the step, where the cloth was last searched for.
        places: The places on the skin that hold the vertices off.
        planes: Tangent planes at these places.
    """

    places: SkinPoints
    planes: Planes

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
        self.ahead, self._searched_at = surface.closest(guess, now, fixed, closest), guess.copy()
        surprised = (closest.face < 0) & (self.ahead.face >= 0)
        if surprised.any():
            wide = surface.closest(start, then, ~surprised, reach=WIDE_REACH * surface.reach)
            closest = select_rows(surprised, wide, closest)
        self.closest_at_start = closest

    @abstractmethod
    def move(self, positions: Float[np.ndarray, "verts 3"]) -> bool:
        """Updates the planes to the cloth at the end of the step.

        Returns:
            Whether a vertex moved far enough for a new search.
        """

    def second_places(self, thickness: float, friction: Float[np.ndarray, " verts"]) -> list[PairRows]:
        """Returns pairs for the second places that hold vertices off; here there are none.

        Args:
            thickness: Distance that cloth keeps from the body [m].
            friction: Coulomb's coefficient of each vertex.
        """
        return []

    def history_faces(self, before: Int[np.ndarray, "verts 2"] | None) -> Int[np.ndarray, "verts 2"] | None:
        """Returns the contact history at the end of the step, given the one at its start; here it is unchanged."""
        return before

    def planes_at(self, closest: SkinPoints) -> Planes:
        """Returns the tangent planes at places on the skin."""
        return self.surface.planes(closest, self.start, self.then, self.now, self.stiffness)

    def _search_again(self, positions: Float[np.ndarray, "verts 3"]) -> bool:
        """Searches for the closest skin under vertices that have moved; returns whether there are any."""
        selected = np.empty(len(positions), bool)
        if not mark_strays(positions, self.fixed, SEARCH_AGAIN_DISTANCE, self._searched_at, selected):
            return False
        self.ahead = self.surface.closest(positions, self.now, self.fixed, self.ahead, selected=selected)
        return True


class ClosestContact(Contact):
    """Contact of each vertex with the skin that is closest to it.

    A plane found at the start of the step moves with the surface, so that it lies on the side that the cloth comes
    from, however far the body moves within the step. Later searches must not change that side while the vertex is
    inside the body: the nearest surface may then be the far side of a hand or a foot.

    Args:
        surface, then, now, start, guess, fixed, stiffness, known: See `Contact`.
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
        super().__init__(surface, then, now, start, guess, fixed, stiffness, known)
        self.places, self.planes = self.closest_at_start, self.planes_at(self.closest_at_start)

    def move(self, positions: Float[np.ndarray, "verts 3"]) -> bool:
        """Updates the planes to the cloth at the end of the step, see `Contact.move`."""
        if not self._search_again(positions):
            return False
        planes, before = self.planes_at(self.ahead), self.planes
        turned = np.empty(len(positions), bool)
        mark_turned_inside(
            positions, before.normal, before.stiffness, planes.normal, planes.point, planes.stiffness, turned
        )
        self.places = select_rows(turned, self.places, self.ahead)
        self.planes = select_rows(turned, self.planes, planes)
        return True

    def subset(self, which: Bool[np.ndarray, " verts"]) -> "ClosestContact":
        """Returns the contact of some of the vertices."""
        part = copy(self)
        part.start, part.fixed, part.stiffness = self.start[which], self.fixed[which], self.stiffness[which]
        part._searched_at = self._searched_at[which]
        part.places, part.ahead, part.planes = (_rows(each, which) for each in (self.places, self.ahead, self.planes))
        part.closest_at_start = _rows(self.closest_at_start, which)
        return part


def select_rows(which: Bool[np.ndarray, " verts"], first, second):
    """Returns the rows of the first tuple of arrays where `which` is set, those of the second elsewhere."""
    if not which.any():
        return second
    columns = which[:, None]
    pairs = zip(first, second, strict=True)
    return type(second)(*(np.where(which if a.ndim == 1 else columns, a, b) for a, b in pairs))


def _rows(of, which: Bool[np.ndarray, " verts"]):
    """Returns some rows of a tuple of arrays."""
    return type(of)(*(each[which] for each in of))
