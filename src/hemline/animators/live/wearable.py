"""`live` before it is given a garment: options, and nothing else."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Self

import numpy as np

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
    """A model that simulates any garment, without a fit. `animator_for` makes the animator of one garment.

    Example:
        >>> import hemline
        >>> body = hemline.bodies.load("anny24").shaped()
        >>> skirt = hemline.load("live").animator_for(hemline.garments.load("skirt-light"), body)
        >>> skirt.name
        'live'
    """

    config: LiveConfig = field(default_factory=LiveConfig)
    """Options of the simulation."""
    material: Material | None = None
    """Material of all garments; None keeps that of each garment. Model files do not hold it."""

    @property
    def name(self) -> str:
        """Name of the kind of animator."""
        return "live"

    @property
    def figures(self) -> Mapping[str, float]:
        """No figures, since nothing was fitted."""
        return {}

    def animator_for(self, garment: Garment, body: ShapedBody) -> AnimatorLive:
        """Returns the animator of one garment on one body. The garment settles first, which takes a few seconds.

        Raises:
            BadGarment: The garment was made for another body, or a material was chosen and it has several pieces.
            SimulationFailed: The garment could not be settled.
        """
        chosen = garment if self.material is None else garment.in_material(self.material)
        return AnimatorLive.on(chosen, body, self.config)

    @property
    def known_materials(self) -> tuple[str, ...]:
        """Names of all materials, since any can be simulated."""
        return tuple(MATERIALS)

    def in_material(self, material: Material | str) -> Self:
        """Returns the model for garments made of a material, given as such or by name.

        Raises:
            BadGarment: There is no such material.
        """
        return replace(self, material=Material.of(material))

    def in_wind(self, wind: tuple[float, float, float]) -> Self:
        """Returns the model for garments in a wind of the world [m/s]."""
        return replace(self, config=replace(self.config, wind=wind))

    def save(self, path: str | Path) -> None:
        """Writes a model file that holds the options: the whole file or, on failure, none.

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
        """Reads the options from the metadata of a model file.

        Raises:
            BadModel: Options are missing, unknown or impossible.
        """
        return cls(options_of(LiveConfig, entry(metadata, "config", dict), error=BadModel))


def read_live(arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> AnimatorLive | Live:
    """Reads an `AnimatorLive` from a model file that names a garment, and `Live` from any other.

    Raises:
        BadModel: `AnimatorLive.of` or `Live.of` refuses the file.
    """
    return AnimatorLive.of(arrays, metadata) if "garment" in metadata else Live.of(metadata)
