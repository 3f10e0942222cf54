"""Contact during one step of cloth that remembers where it came from."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from hemline.sim.contact.body.body_contact import Contact
from hemline.sim.contact.body.planes import SkinPoints
from hemline.sim.contact.body.surface import MovingSkin, BodySurface
from hemline.sim.contact.pairs.pair_kernels import PairRows

from .contact_history import ContactHistory


class Wearing(NamedTuple):
    """What a step knows of each vertex of the cloth.

    Attributes:
        history: The places of the body that held it off.
        home: The limb that it lies on at rest.
        pinched: Whether it has no free place, as parts of the body are inside each other there.
        yielding: Share of the stiffness that is left to another limb there.
    """

    history: ContactHistory
    home: Int[np.ndarray, " verts"]
    pinched: Bool[np.ndarray, " verts"]
    yielding: float


class ContactWithHistory(Contact):
    """Contact where each vertex keeps to the places that held it off: one plane each, a second one where it has two.

    Args:
        surface, then, now, start, guess, fixed, stiffness, known: As of `Contact`.
        wearing: Of the vertices, at the step's start.

    Attributes:
        history: Of the vertices, where the cloth is.
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
        known: SkinPoints | None,
        wearing: Wearing,
    ):
        self.wearing, self._full = wearing, stiffness
        super().__init__(surface, then, now, start, guess, fixed, stiffness, known)

    def move(self, positions: Float[np.ndarray, "verts 3"]) -> bool:
        """Find the planes again, where the cloth is at the step's end; whether a vertex moved far enough for that."""
        if not self._sought_again(positions):
            return False
        history = self.history.moved(self.surface, positions, self.now, self.ahead, self.wearing.home)
        self._hold(history, positions, self.now)
        return True

    def second(self, thickness: float, friction: Float[np.ndarray, " verts"]) -> list[PairRows]:
        """The second places, as pairs of cloth and body, if there are any.

        Args:
            thickness: Distance that cloth keeps from the body [m].
            friction: Coulomb's coefficient of each vertex.
        """
        history, which = self.history, np.flatnonzero(self.history.face[1] >= 0)
        if not (len(which) and thickness):
            return []
        nearest, face, weights = history.nearest[1, which], history.face[1, which], history.weights[1, which]
        planes = self.surface.planes(
            SkinPoints(nearest, face, weights), self.start[which], self.then, self.now, self._second_stiffness[which]
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

    def _begin(self, closest: SkinPoints) -> None:
        wearing = self.wearing
        history = wearing.history.moved(self.surface, self.start, self.then, closest, wearing.home)
        self._hold(history, self.start, self.then)

    def _hold(self, history: ContactHistory, positions: Float[np.ndarray, "verts 3"], skin: MovingSkin) -> None:
        wearing = self.wearing
        self.history, self.places = history, history.first
        self.stiffness, self._second_stiffness = history.stiffnesses(
            self.surface, positions, skin, wearing.home, wearing.pinched, self._full, wearing.yielding
        )
        self.planes = self.laid(self.places)
