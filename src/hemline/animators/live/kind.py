"""What the registry knows of `live`: its options, its model files, and that nothing is fitted."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from hemline.animators.base import Progress
from hemline.errors import BadInput

from .config import LiveConfig
from .model import AnimatorLive
from .wearable import Live


class LiveKind:
    """Garments simulated in real time, as `animators.base.AnimatorKind` asks."""

    name = "live"
    Config = LiveConfig

    def fit(
        self,
        data: Any,
        config: LiveConfig | None = None,
        *,
        seed: int = 0,
        progress: Progress | None = None,
        checkpoints: Path | None = None,
    ) -> NoReturn:
        """Refused.

        Raises:
            BadInput: Always.
        """
        raise BadInput("animator 'live' learns nothing", "a fit", "play it: hemline animate live --garment GARMENT")

    def of(self, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> AnimatorLive | Live:
        """Make one from what a model file holds: `AnimatorLive` where it names a garment, else `Live`.

        Raises:
            BadModel: As `AnimatorLive.of` and `Live.of`.
        """
        return AnimatorLive.of(arrays, metadata) if "garment" in metadata else Live.of(metadata)


KIND = LiveKind()
