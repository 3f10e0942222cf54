"""What the registry knows of `swingar`: its options, its fit, its model files."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hemline.animators.base import Progress
from hemline.errors import BadDataset

from .config import SwingarConfig
from .model import AnimatorSwingar
from .wearable import Swingar

if TYPE_CHECKING:
    from hemline.datasets import Collection, Dataset


class SwingarKind:
    """SwinGar, as `animators.base.AnimatorKind` asks."""

    name = "swingar"
    Config = SwingarConfig

    def fit(
        self,
        data: "Dataset | Collection",
        config: SwingarConfig | None = None,
        *,
        seed: int = 0,
        progress: Progress | None = None,
        checkpoints: Path | None = None,
    ) -> Swingar:
        """Learn from takes of many garments, or go on from a model with takes of one; see `fit.fit`.

        Raises:
            BadDataset: Takes of a single garment, and no model to go on from; or as `fit.fit`.
        """
        from hemline.datasets import Collection

        from .fit import fit

        if not isinstance(data, Collection):
            if not (config and config.start):
                cure = "name several datasets, or go on from a model: --start swingar"
                raise BadDataset("swingar is fitted to many garments", data.garment.name, cure)
            data = Collection((data,))
        return fit(data, config, seed=seed, progress=progress, checkpoints=checkpoints)

    def of(self, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> AnimatorSwingar | Swingar:
        """Make one from what a model file holds: `AnimatorSwingar` where it names a garment, else `Swingar`."""
        return AnimatorSwingar.of(arrays, metadata) if "garment" in metadata else Swingar.of(arrays, metadata)


KIND = SwingarKind()
