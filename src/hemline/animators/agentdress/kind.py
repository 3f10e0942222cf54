"""What the registry knows of AgentDress: its options, its fit, its model files."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hemline.animators.base import Progress

from .config import AgentDressConfig
from .model import AnimatorAgentDress

if TYPE_CHECKING:
    from hemline.datasets import Collection, Dataset


class AgentDressKind:
    """AgentDress, as `animators.base.AnimatorKind` asks."""

    name = "agentdress"
    Config = AgentDressConfig

    def fit(
        self,
        data: "Dataset | Collection",
        config: AgentDressConfig | None = None,
        *,
        seed: int = 0,
        progress: Progress | None = None,
        checkpoints: Path | None = None,
    ) -> AnimatorAgentDress:
        """Learn from anchors; see `fit.fit`. Nothing is left to chance, and it takes a minute.

        Of several datasets the first one has the anchors, the others the same garment of other materials.

        Raises:
            BadDataset: As `fit.fit`.
            BadInput: As `fit.fit`.
        """
        from hemline.animators.agentdress.fit.fit import fit
        from hemline.datasets import Collection

        first, *others = data.datasets if isinstance(data, Collection) else (data,)
        return fit(first, config, materials=others, progress=progress)

    def of(self, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> AnimatorAgentDress:
        """Make one from what a model file holds; see `AnimatorAgentDress.of`."""
        return AnimatorAgentDress.of(arrays, metadata)


KIND = AgentDressKind()
