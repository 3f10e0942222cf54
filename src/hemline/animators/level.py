"""The base of levels of detail: what each takes from its full animator."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hemline.bodies.body import ShapedBody

from .base import Animator, Detailed, Movable
from .rigid_transform import RigidTransform


class LevelOf:
    """A level of detail with the identity, the model file and the other levels of its full animator."""

    full: Animator
    """The animator with all vertices."""

    @property
    def name(self) -> str:
        """Name of the kind of animator."""
        return self.full.name

    @property
    def body_name(self) -> str:
        """Name of the body that the garment was fitted on."""
        return self.full.body_name

    @property
    def body_hash(self) -> str:
        """Hash of that body."""
        return self.full.body_hash

    @property
    def figures(self) -> Mapping[str, float]:
        """Figures of the fit of the full animator."""
        return self.full.figures

    def at_detail(self, detail: float) -> Animator:
        """Returns another level of the full animator."""
        return self.full.at_detail(detail) if isinstance(self.full, Detailed) else self.full

    def relocate(self, state: Any, shaped: ShapedBody, transform: RigidTransform) -> Any:
        """Relocates a State as the full animator does if it is `Movable`, else returns the State."""
        return self.full.relocate(state, shaped, transform) if isinstance(self.full, Movable) else state

    def save(self, path: str | Path) -> None:
        """Writes the model file of the full animator, from which all levels are made."""
        self.full.save(path)
