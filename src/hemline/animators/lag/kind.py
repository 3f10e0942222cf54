"""What the registry knows of `lag`: its options, its fit, its model files."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from hemline.animators.coarse.kind import CoarseKind
from hemline.animators.coarse.network import Network
from hemline.animators.coarse.proxy_on_body import DYNAMIC_COUNT, STATIC_COUNT
from hemline.files.contents import array_of

from .config import LagConfig
from .lag_net import LagNet, layer_sizes
from .lag_network import LagNetwork


class LagKind(CoarseKind):
    """The lag network."""

    name = "lag"
    version = 1
    Config = LagConfig

    def train(self, frames: Any, config: Any, **options: Any) -> tuple[Network, dict[str, float]]:
        """Learn, see `fit_lag.fit_lag`."""
        from hemline.animators.lag.fit.fit_lag import fit_lag

        return fit_lag(frames, config, **options)

    def network_of(self, arrays: Mapping[str, np.ndarray], config: Any, own: Mapping[str, Any]) -> LagNetwork:
        """The network of a model file; raises BadModel."""
        weights, biases = {}, {}
        for name, (inputs, outputs) in layer_sizes(STATIC_COUNT + DYNAMIC_COUNT, config.width).items():
            weights[name] = array_of(arrays, f"weight.{name}", "float16", (inputs, outputs)).astype(np.float32)
            biases[name] = array_of(arrays, f"bias.{name}", "float32", (outputs,))
        return LagNetwork(LagNet(weights, biases))


KIND = LagKind()
