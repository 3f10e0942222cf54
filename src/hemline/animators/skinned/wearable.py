"""`skinned` before it is given a garment: options, and nothing else."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Self

import numpy as np

from hemline.animators.model_file import save_model
from hemline.bodies import ShapedBody
from hemline.errors import BadModel
from hemline.files.contents import entry
from hemline.garments import Garment
from hemline.options import options_of

from .config import SkinnedConfig
from .model import AnimatorSkinned


@dataclass(frozen=True)
class Skinned:
    """A model that skins any garment, without a fit. `animator_for` makes the animator of one garment.

    Example:
        >>> import hemline
        >>> body = hemline.bodies.load("anny24").shaped()
        >>> leggings = hemline.load("skinned").animator_for(hemline.garments.load("trousers-light"), body)
        >>> leggings.name
        'skinned'
    """

    config: SkinnedConfig = field(default_factory=SkinnedConfig)
    """Size of the coarse copy that settles."""

    @property
    def name(self) -> str:
        """Name of the kind of animator."""
        return "skinned"

    @property
    def figures(self) -> Mapping[str, float]:
        """No figures, since nothing was fitted."""
        return {}

    def animator_for(self, garment: Garment, body: ShapedBody) -> AnimatorSkinned:
        """Returns the animator of one garment on one body. The garment settles first, which takes a few seconds.

        Raises:
            BadGarment: The garment was made for another body.
        """
        return AnimatorSkinned.on(garment, body, self.config)

    def save(self, path: str | Path) -> None:
        """Writes a model file that holds the options: the whole file or, on failure, none.

        Raises:
            BadOutput: The path cannot be written.
        """
        options = asdict(self.config)
        save_model(path, self.name, {}, garment=None, body={}, config=options, figures={}, licences=[], extra={})

    @classmethod
    def of(cls, metadata: Mapping[str, Any]) -> Self:
        """Reads the options from the metadata of a model file.

        Raises:
            BadModel: Options are missing, unknown or impossible.
        """
        return cls(options_of(SkinnedConfig, entry(metadata, "config", dict), error=BadModel))


def read_skinned(arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> AnimatorSkinned | Skinned:
    """Reads an `AnimatorSkinned` from a model file that names a garment, and `Skinned` from any other.

    Raises:
        BadModel: `AnimatorSkinned.of` or `Skinned.of` refuses the file.
    """
    return AnimatorSkinned.of(arrays, metadata) if "garment" in metadata else Skinned.of(metadata)
