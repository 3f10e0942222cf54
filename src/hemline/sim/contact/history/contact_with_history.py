"""Contact in one step of cloth that remembers which places on the skin kept it outside the body."""

import numpy as np
from jaxtyping import Bool, Float, Int

from hemline.sim.contact.body.body_contact import Contact
from hemline.sim.contact.body.planes import SkinPoints
from hemline.sim.contact.body.surface import BodySurface, MovingSkin
from hemline.sim.contact.pairs.pair_kernels import PairRows

from .contact_history import ContactHistory, HistoryFaces


class ContactWithHistory(Contact):
    """Contact in which each vertex keeps the places that held it outside: one plane, or two if it has a second place.

    Args:
        surface, then, now, start, guess, fixed, stiffness, known: See `Contact`.
        history: The places of each vertex at the start of the step.
        rest_limb: Limb of the body that each vertex lies on at rest.
        pinched: Vertices that cannot leave the body, because parts of it intersect there.
        yielding: Fraction of the stiffness that remains for a limb other than the vertex's own.

    Attributes:
        history: The places of each vertex, where the cloth is now.
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
        *,
        history: ContactHistory,
        rest_limb: Int[np.ndarray, " verts"],
        pinched: Bool[np.ndarray, " verts"],
        yielding: float,
    ):
        super().__init__(surface, then, now, start, guess, fixed, stiffness, known)
        self._full_stiffness, self._rest_limb, self._pinched, self._yielding = stiffness, rest_limb, pinched, yielding
        history = history.advance(surface, start, then, self.closest_at_start, rest_limb)
        self._set_history(history, start, then)

    def move(self, positions: Float[np.ndarray, "verts 3"]) -> bool:
        """Updates the planes to the cloth at the end of the step, see `Contact.move`."""
        if not self._search_again(positions):
            return False
        history = self.history.advance(self.surface, positions, self.now, self.ahead, self._rest_limb)
        self._set_history(history, positions, self.now)
        return True

    def second_places(self, thickness: float, friction: Float[np.ndarray, " verts"]) -> list[PairRows]:
        """Returns the second places as pairs of cloth and body, see `Contact.second_places`."""
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

    def history_faces(self, before: HistoryFaces | None) -> HistoryFaces | None:
        """Returns the contact history where the cloth is now."""
        return self.history.faces

    def _set_history(self, history: ContactHistory, positions: Float[np.ndarray, "verts 3"], skin: MovingSkin) -> None:
        """Stores the places of a history, and computes stiffnesses and planes from them."""
        self.history, self.places = history, history.first
        self.stiffness, self._second_stiffness = history.stiffnesses(
            self.surface, positions, skin, self._rest_limb, self._pinched, self._full_stiffness, self._yielding
        )
        self.planes = self.planes_at(self.places)
