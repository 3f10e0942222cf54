"""Contact during one step of cloth that remembers where it came from."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from .body_contact import Contact
from .pair_kernels import PairRows
from .planes import Anchors
from .sides import Sides
from .surface import Skin, Surface


class Wearing(NamedTuple):
    """What a step knows of each vertex of the cloth.

    Attributes:
        sides: The places of the body that held it off.
        home: The limb that it lies on at rest.
        pinched: Whether it has no free place, as parts of the body are inside each other there.
        yielding: Share of the stiffness that is left to another limb there.
    """

    sides: Sides
    home: Int[np.ndarray, " verts"]
    pinched: Bool[np.ndarray, " verts"]
    yielding: float


class SidedContact(Contact):
    """Contact where each vertex keeps to its sides of the body: one plane a vertex, a second one where it has two.

    Args:
        surface, then, now, start, guess, fixed, push, known: As of `Contact`.
        wearing: Of the vertices, at the step's start.

    Attributes:
        sides: Of the vertices, where the cloth is.
    """

    def __init__(
        self,
        surface: Surface,
        then: Skin,
        now: Skin,
        start: Float[np.ndarray, "verts 3"],
        guess: Float[np.ndarray, "verts 3"],
        fixed: Bool[np.ndarray, " verts"],
        push: Float[np.ndarray, " verts"],
        known: Anchors | None,
        wearing: Wearing,
    ):
        self.wearing, self._full = wearing, push
        super().__init__(surface, then, now, start, guess, fixed, push, known)

    def move(self, positions: Float[np.ndarray, "verts 3"]) -> bool:
        """Find the planes again, where the cloth is at the step's end; whether a vertex moved far enough for that."""
        if not self._sought_again(positions):
            return False
        sides = self.sides.moved(self.surface, positions, self.now, self.ahead, self.wearing.home)
        self._hold(sides, positions, self.now)
        return True

    def second(self, thickness: float, friction: Float[np.ndarray, " verts"]) -> list[PairRows]:
        """The second places, as pairs of cloth and body, if there are any.

        Args:
            thickness: Distance that cloth keeps from the body [m].
            friction: Coulomb's coefficient of each vertex.
        """
        sides, which = self.sides, np.flatnonzero(self.sides.face[1] >= 0)
        if not (len(which) and thickness):
            return []
        nearest, face, weights = sides.nearest[1, which], sides.face[1, which], sides.weights[1, which]
        planes = self.surface.planes(
            Anchors(nearest, face, weights), self.start[which], self.then, self.now, self._push_of_second[which]
        )
        depth = np.clip(thickness - planes.gap(planes.carried), 0, thickness)
        return [
            PairRows(
                corners=np.repeat(which[:, None], 4, axis=1).astype(np.uint32),
                weights=np.repeat([[1.0, 0, 0, 0]], len(which), axis=0),
                normal=planes.normal,
                reach=np.einsum("px,px->p", planes.normal, planes.point) + thickness,
                carried=planes.carried,
                thickness=np.full(len(which), thickness),
                stiffness=planes.stiffness,
                limit=friction[which] * planes.stiffness * depth**2 / thickness,
            )
        ]

    def _begin(self, anchors: Anchors) -> None:
        wearing = self.wearing
        sides = wearing.sides.moved(self.surface, self.start, self.then, anchors, wearing.home)
        self._hold(sides, self.start, self.then)

    def _hold(self, sides: Sides, positions: Float[np.ndarray, "verts 3"], skin: Skin) -> None:
        wearing = self.wearing
        self.sides, self.anchors = sides, sides.first
        self.push, self._push_of_second = sides.pushes(
            self.surface, positions, skin, wearing.home, wearing.pinched, self._full, wearing.yielding
        )
        self.planes = self.laid(self.anchors)
