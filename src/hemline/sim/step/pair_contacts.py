"""All pair contact in one step: the cloth with itself, vertices of the body, second places (the point on the skin that
a vertex has just left, see `ContactHistory`), and capsules around bones.
"""

from hemline.sim.cloth.sheet import Positions
from hemline.sim.contact.body.body_contact import Contact
from hemline.sim.contact.pairs.pair_kernels import PairRows
from hemline.sim.contact.pairs.pairs import Pairs

from .model import ClothModel
from .workspace import Workspace


class PairContacts:
    """Finds the pairs of one step and updates them as the cloth moves.

    Args:
        model: The sheet.
        workspace: Provides the searches.
        contact: Contact of the vertices with the body, or None.
        start: The cloth at the start of the step [m].
        guess: Predicted cloth at the end of the step [m].
        capsule_pairs: Pairs of capsules and cloth; None if no capsule is near.

    Attributes:
        self_contact: Pairs of the cloth with itself, or None.
        points: Points of the cloth above vertices of the body, or None.
    """

    def __init__(
        self,
        model: ClothModel,
        workspace: Workspace,
        contact: Contact | None,
        start: Positions,
        guess: Positions,
        capsule_pairs: PairRows | None = None,
    ):
        self.model, self.contact, self._capsule_pairs = model, contact, capsule_pairs
        self.self_contact = None if workspace.self_search is None else workspace.self_search.find(start, guess)
        self.points = None if contact is None else workspace.point_search.find(contact, guess)

    def at(self, positions: Positions) -> Pairs | None:
        """Returns the pairs where the cloth is now, or None if nothing is near."""
        parts = [] if self.self_contact is None else self.self_contact.pair_rows(positions)
        if self.points is not None:
            parts.append(self.points.pair_rows())
        if self.contact is not None:
            parts += self.contact.second_places(self.model.settings.thickness, self.model.sheet.friction)
        if self._capsule_pairs is not None:
            parts.append(self._capsule_pairs)
        return Pairs.of(parts, self.model.sheet.vertex_count) if parts else None
