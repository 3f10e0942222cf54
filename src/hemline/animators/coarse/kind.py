"""What the registry knows of an animator whose network moves a coarse garment."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hemline.animators.base import Progress
from hemline.errors import BadDataset

from .config import CoarseConfig
from .model import CoarseAnimator
from .network import Network
from .wearable import CoarseWearable

if TYPE_CHECKING:
    from hemline.animators.coarse.fit.split_frames import SplitFrames
    from hemline.datasets import Collection, Dataset


class CoarseKind(ABC):
    """An `animators.base.AnimatorKind` whose network moves a coarse garment; each network has a class of its own."""

    name: str
    """Name of the animator in model files and on the command line."""
    version: int
    """Version of what its model files hold under its name."""
    Config: type[CoarseConfig]
    """Class of the options of its fit."""

    @abstractmethod
    def train(
        self,
        frames: "SidedFrames",
        config: Any,
        *,
        start: Any,
        seed: int,
        mark: str,
        checkpoints: Path | None,
        tell: Callable[[str, int, int], None],
    ) -> tuple[Network, dict[str, float]]:
        """Learn.

        Args:
            frames: Frames to learn from, `train`, and frames to choose the best epoch by, by what is new about them.
            config: Options.
            start: The network to go on from; None: from skinning.
            seed: Seed of all that is random.
            mark: Hash of all that the fit depends on.
            checkpoints: A folder for the state of the training; None: it is not kept.
            tell: Called with stage, steps done and steps in all.

        Returns:
            The network, and its figures.

        Raises:
            BadModel: The training diverged.
        """

    @abstractmethod
    def network_of(self, arrays: Mapping[str, np.ndarray], config: Any, own: Mapping[str, Any]) -> Network:
        """The network of a model file, see `weights.NetworkReader`."""

    def fit(
        self,
        data: "Dataset | Collection",
        config: Any = None,
        *,
        seed: int = 0,
        progress: Progress | None = None,
        checkpoints: Path | None = None,
    ) -> CoarseWearable:
        """Learn from takes of many garments, or go on from a model with takes of one; see `fit.fit`.

        Raises:
            BadDataset: Takes of a single garment, and no model to go on from; or as `fit.fit`.
        """
        from hemline.animators.coarse.fit.fit import fit
        from hemline.datasets import Collection

        config = config or self.Config()
        if not isinstance(data, Collection):
            if not config.start:
                cure = f"name several datasets, or go on from a model: --start {self.name}"
                raise BadDataset(f"{self.name} is fitted to many garments", data.garment.name, cure)
            data = Collection((data,))
        return CoarseWearable(fit(self, data, config, seed=seed, progress=progress, checkpoints=checkpoints))

    def of(self, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> CoarseAnimator | CoarseWearable:
        """Make one from what a model file holds: an animator where it names a garment, else a wearable.

        Raises:
            BadModel: As `CoarseAnimator.of` and `CoarseWearable.of`.
        """
        made = CoarseAnimator if "garment" in metadata else CoarseWearable
        return made.of(self, arrays, metadata)
