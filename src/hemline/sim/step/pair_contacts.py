"""Everything that meets in pairs during one step."""

from hemline.sim.cloth.sheet import Positions
from hemline.sim.contact.body.body_contact import Contact
from hemline.sim.contact.history.contact_with_history import ContactWithHistory
from hemline.sim.contact.pairs.pair_kernels import PairRows
from hemline.sim.contact.pairs.pairs import Pairs

from .model import ClothModel
from .workspace import Workspace


class PairContacts:
    """The pairs of one step: the cloth with itself, the body's vertices, second places and capsules.

    Args:
        model: The sheet.
        workspace: Its searches are used.
        contact: Of the vertices with the body, or None.
        start: The cloth at the step's start [m].
        guess: Where it is taken to go [m].
        off_bones: Pairs of capsules and cloth; None: none are near.
    """

    def __init__(
        self,
        model: ClothModel,
        workspace: Workspace,
        contact: Contact | None,
        start: Positions,
        guess: Positions,
        off_bones: PairRows | None = None,
    ):
        self.model, self.contact, self._off_bones = model, contact, off_bones
        self.itself = None if workspace.self_search is None else workspace.self_search.find(start, guess)
        self.points = None if contact is None else workspace.point_search.find(contact, guess)

    def lay(self, positions: Positions) -> Pairs | None:
        """The pairs where the cloth is now; None: nothing of the kind is near."""
        parts = [] if self.itself is None else self.itself.lay(positions)
        if self.points is not None:
            parts.append(self.points.lay())
        if isinstance(self.contact, ContactWithHistory):
            parts += self.contact.second(self.model.settings.thickness, self.model.sheet.friction)
        if self._off_bones is not None:
            parts.append(self._off_bones)
        return Pairs.of(parts, self.model.sheet.vertex_count) if parts else None
