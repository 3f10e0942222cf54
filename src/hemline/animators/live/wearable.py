"""`live` before it is given a garment: options, and nothing else."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Self

from hemline.animators.model_file import save_model
from hemline.bodies import ShapedBody
from hemline.errors import BadModel
from hemline.files.contents import entry
from hemline.garments import MATERIALS, Garment, Material
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
    material: Material | None = None
    """What garments are made of; None: of what they say. It is not kept in files."""

    @property
    def name(self) -> str:
        """Name of its kind."""
        return "live"

    @property
    def figures(self) -> Mapping[str, float]:
        """None: nothing was fitted."""
        return {}

    def animator_for(self, garment: Garment, body: ShapedBody) -> AnimatorLive:
        """The animator of one garment on one body: a few seconds, in which the garment settles.

        Raises:
            BadGarment: The garment was made on another body.
            BadGarment: A material was chosen, and the garment has several pieces.
            SimulationFailed: The garment could not be settled.
        """
        worn = garment if self.material is None else garment.in_material(self.material)
        return AnimatorLive.on(worn, body, self.config)

    @property
    def known_materials(self) -> tuple[str, ...]:
        """All: it simulates."""
        return tuple(MATERIALS)

    def in_material(self, material: Material | str) -> Self:
        """The same for garments made of a material, or of the name of one.

        Raises:
            BadGarment: No such material.
        """
        return replace(self, material=Material.of(material))

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
