"""What the registry knows of rope chains: their options, their fit, their model files."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hemline.animators.base import Progress

from .config import RopesConfig
from .model import AnimatorRopes

if TYPE_CHECKING:
    from hemline.datasets import Dataset


class RopesKind:
    """Rope chains, as `animators.base.AnimatorKind` asks."""

    name = AnimatorRopes.name
    Config = RopesConfig

    def fit(
        self,
        data: "Dataset",
        config: RopesConfig | None = None,
        *,
        seed: int = 0,
        progress: Progress | None = None,
        checkpoints: Path | None = None,
    ) -> AnimatorRopes:
        """Learn from simulated takes; see `fit.fit`, which is imported now: playing does not need it."""
        from .fit import fit

        return fit(data, config, seed=seed, progress=progress, checkpoints=checkpoints)

    def of(self, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> AnimatorRopes:
        """Make one from what a model file holds; see `AnimatorRopes.of`."""
        return AnimatorRopes.of(arrays, metadata)


KIND = RopesKind()
