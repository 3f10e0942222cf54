"""The lag network with its inputs, as `coarse.network.Network` asks."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from hemline.animators.coarse.features.trail import Trail
from hemline.animators.coarse.network import Prediction
from hemline.animators.coarse.proxy_on_body import ProxyOnBody
from hemline.bodies import PosedBody
from hemline.motions.motion import Pose

from .lag_net import LagNet


@dataclass(frozen=True, eq=False)
class LagNetwork:
    """All that it remembers is the Trail."""

    net: LagNet

    def prepare(self, proxy: ProxyOnBody) -> Any:
        """The part of the first layer that does not change."""
        return self.net.static(proxy.static)

    def start(self, pose: Pose) -> None:
        """Nothing is remembered beside the Trail."""

    def predict(self, prepared: Any, proxy: ProxyOnBody, trail: Trail, history: None, posed: PosedBody) -> Prediction:
        """Skinning, displaced."""
        displacements = self.net.displacements(prepared, trail.features(proxy, posed), proxy.cells)
        return None, trail.add_displacements(displacements)

    def arrays(self) -> Mapping[str, np.ndarray]:
        """Weights in half precision, which is all that they are worth; biases in single."""
        found = {f"weight.{name}": array.astype(np.float16) for name, array in self.net.weights.items()}
        return found | {f"bias.{name}": array.astype(np.float32) for name, array in self.net.biases.items()}

    def extra(self) -> Mapping[str, Any]:
        """Nothing is said beside the weights."""
        return {}
