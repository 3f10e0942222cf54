"""What the registry knows of rope chains: their options, their fit, their model files."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hemline.animators.base import Progress
from hemline.errors import BadDataset

from .config import RopesConfig
from .model import AnimatorRopes

if TYPE_CHECKING:
    from hemline.datasets import Collection, Dataset


class RopesKind:
    """Rope chains, as `animators.base.AnimatorKind` asks."""

    name = "ropes"
    Config = RopesConfig

    def fit(
        self,
        data: "Dataset | Collection",
        config: RopesConfig | None = None,
        *,
        seed: int = 0,
        progress: Progress | None = None,
        checkpoints: Path | None = None,
    ) -> AnimatorRopes:
        """Learn from simulated takes; see `fit.fit`, which is imported now: playing does not need it.

        Raises:
            BadDataset: Takes of several garments; or as `fit.fit`.
        """
        from hemline.animators.ropes.fit.fit import fit
        from hemline.datasets import Collection

        if isinstance(data, Collection):
            names = ", ".join(garment.name for garment in data.garments)
            raise BadDataset("rope chains are fitted to one garment", names, "name one dataset")
        return fit(data, config, seed=seed, progress=progress, checkpoints=checkpoints)

    def of(self, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> AnimatorRopes:
        """Make one from what a model file holds; see `AnimatorRopes.of`."""
        return AnimatorRopes.of(arrays, metadata)


KIND = RopesKind()
