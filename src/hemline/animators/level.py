"""What every lower level of detail hands on from the animator that it is of."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hemline.bodies.body import ShapedBody

from .base import Animator, Detailed, Movable
from .teleport import RigidTransform


class LevelOf:
    """Base of a level of detail: its identity, its file and its other levels are those of the full animator."""

    full: Animator
    """The one with all vertices."""

    @property
    def name(self) -> str:
        """As of the full animator."""
        return self.full.name

    @property
    def body_name(self) -> str:
        """As of the full animator."""
        return self.full.body_name

    @property
    def body_hash(self) -> str:
        """As of the full animator."""
        return self.full.body_hash

    @property
    def figures(self) -> Mapping[str, float]:
        """What the fit of the full animator reached."""
        return self.full.figures

    def at_detail(self, detail: float) -> Animator:
        """Another level of the full animator."""
        return self.full.at_detail(detail) if isinstance(self.full, Detailed) else self.full

    def relocate(self, state: Any, shaped: ShapedBody, way: RigidTransform) -> Any:
        """As of the full animator, where that is `Movable`."""
        return self.full.relocate(state, shaped, way) if isinstance(self.full, Movable) else state

    def save(self, path: str | Path) -> None:
        """Write the model file of the full animator, which all levels are made from."""
        self.full.save(path)
