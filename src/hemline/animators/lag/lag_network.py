"""The lag network with its inputs, as `coarse.network.Network` asks."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from hemline.animators.coarse.features.columns import DYNAMIC, STATIC
from hemline.animators.coarse.features.trail import Trail
from hemline.animators.coarse.network import Prediction
from hemline.animators.coarse.proxy_on_body import ProxyOnBody
from hemline.bodies import PosedBody
from hemline.files.contents import array_of
from hemline.motions.motion import Pose

from .config import LagConfig
from .lag_net import LagNet, layer_sizes


@dataclass(frozen=True, eq=False)
class LagNetwork:
    """The lag network. The `Trail` is its only memory."""

    net: LagNet

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray], config: LagConfig, own: Mapping[str, Any]) -> Self:
        """Reads the network from a model file, see `coarse.weights.NetworkReader`; raises BadModel."""
        weights, biases = {}, {}
        for name, (inputs, outputs) in layer_sizes(STATIC.count + DYNAMIC.count, config.width).items():
            weights[name] = array_of(arrays, f"weight.{name}", "float16", (inputs, outputs)).astype(np.float32)
            biases[name] = array_of(arrays, f"bias.{name}", "float32", (outputs,))
        return cls(LagNet(weights, biases))

    def prepare(self, proxy: ProxyOnBody) -> Any:
        """Returns the part of the first layer that does not change from frame to frame."""
        return self.net.static(proxy.static)

    def start(self, pose: Pose) -> None:
        """Returns None, since the network remembers nothing beside the Trail."""

    def predict(self, prepared: Any, proxy: ProxyOnBody, trail: Trail, history: None, posed: PosedBody) -> Prediction:
        """Predicts the proxy on a posed body: skinning plus a displacement of each vertex."""
        displacements = self.net.displacements(prepared, trail.features(proxy, posed), proxy.cells)
        return None, trail.add_displacements(displacements)

    def arrays(self) -> Mapping[str, np.ndarray]:
        """Returns the weights in half precision, which is enough for them, and the biases in single precision."""
        found = {f"weight.{name}": array.astype(np.float16) for name, array in self.net.weights.items()}
        return found | {f"bias.{name}": array.astype(np.float32) for name, array in self.net.biases.items()}

    def extra(self) -> Mapping[str, Any]:
        """Returns no metadata, since the weights say everything."""
        return {}
