"""`live` before it is given a garment: options, and nothing else."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Self

from hemline.animators.model_file import save_model
from hemline.bodies import ShapedBody
from hemline.errors import BadModel
from hemline.files.contents import entry
from hemline.garments import Garment
from hemline.options import options_of

from .config import LiveConfig
from .model import AnimatorLive


@dataclass(frozen=True)
class Live:
    """Simulates whatever it is given to wear; nothing is fitted.

    Example:
        >>> import hemline
        >>> body = hemline.bodies.load("anny24").shaped()
        >>> skirt = hemline.load("live").worn_by(hemline.garments.load("skirt-light"), body)
        >>> skirt.name
        'live'
    """

    config: LiveConfig = field(default_factory=LiveConfig)

    @property
    def name(self) -> str:
        """Name of its kind."""
        return "live"

    @property
    def figures(self) -> Mapping[str, float]:
        """None: nothing was fitted."""
        return {}

    def worn_by(self, garment: Garment, body: ShapedBody) -> AnimatorLive:
        """The animator of one garment on one body: a few seconds, in which the garment settles.

        Raises:
            BadGarment: The garment was made on another body.
            SimulationFailed: The garment could not be settled.
        """
        return AnimatorLive.on(garment, body, self.config)

    def save(self, path: str | Path) -> None:
        """Write a model file of options, whole or not at all.

        Raises:
            BadOutput: The path cannot be written.
        """
        save_model(
            path,
            self.name,
            {},
            garment=None,
            body={},
            config=asdict(self.config),
            figures={},
            licences=[],
            extra={},
        )

    @classmethod
    def of(cls, metadata: Mapping[str, Any]) -> Self:
        """Make one from what a model file holds.

        Raises:
            BadModel: Options are missing, unknown, or make no sense.
        """
        return cls(options_of(LiveConfig, entry(metadata, "config", dict), error=BadModel))
