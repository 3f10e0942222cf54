"""The registry entry of an animator whose network moves a proxy."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hemline.animators.base import Progress
from hemline.animators.lazy_kind import import_object
from hemline.errors import BadDataset

from .config import CoarseConfig
from .model import CoarseAnimator
from .network import Network
from .wearable import CoarseWearable

if TYPE_CHECKING:
    from hemline.datasets import Collection, Dataset

    from .fit.split_frames import SplitFrames


@dataclass(frozen=True)
class NetworkKind:
    """An `animators.base.AnimatorKind` whose network moves a proxy. Its training is imported when it is first used.

    Attributes:
        name: Name of the animator in model files and on the command line.
        version: Version of what its model files hold under its name.
        Config: Class of the options of its fit.
        network_of: Reads the network from a model file, see `weights.NetworkReader`.
        trainer: Function that trains the network, as `module:function`; see `train`.
    """

    name: str
    version: int
    Config: type[CoarseConfig]
    network_of: Callable[[Mapping[str, np.ndarray], Any, Mapping[str, Any]], Network]
    trainer: str

    def train(
        self,
        frames: "SplitFrames",
        config: Any,
        *,
        start: Any,
        seed: int,
        mark: str,
        checkpoints: Path | None,
        tell: Callable[[str, int, int], None],
    ) -> tuple[Network, dict[str, float]]:
        """Trains a network.

        Args:
            frames: Frames to train on and frames to choose the best epoch by.
            config: Options of the fit.
            start: Network to continue from; None starts from skinning.
            seed: Seed of everything random.
            mark: Hash of everything that the fit depends on.
            checkpoints: Folder for the state of the training; None keeps none.
            tell: Called with the stage, the steps done and the number of steps.

        Returns:
            The network and its figures.

        Raises:
            BadModel: The training diverged.
        """
        function = import_object(self.trainer)
        return function(frames, config, start=start, seed=seed, mark=mark, checkpoints=checkpoints, tell=tell)

    def fit(
        self,
        data: "Dataset | Collection",
        config: Any = None,
        *,
        seed: int = 0,
        progress: Progress | None = None,
        checkpoints: Path | None = None,
    ) -> CoarseWearable:
        """Fits the network to takes of many garments, or continues from a model with takes of one; see `fit.fit`.

        Raises:
            BadDataset: The takes are of a single garment and no model is named to continue from, or `fit.fit` refuses
                them.
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
        """Reads an animator from a model file that names a garment, and a wearable from any other.

        Raises:
            BadModel: `CoarseAnimator.of` or `CoarseWearable.of` refuses the file.
        """
        made = CoarseAnimator if "garment" in metadata else CoarseWearable
        return made.of(self, arrays, metadata)
