"""The interface of a network that moves a proxy, with its inputs."""

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np

from hemline.animators.coarse.features.trail import Trail
from hemline.arrays import Float
from hemline.bodies import PosedBody
from hemline.motions.motion import Pose

from .proxy_on_body import ProxyOnBody

Prediction = tuple[Any, Float[np.ndarray, "coarse 3"]]
"""The history after a step, and the positions of the proxy's vertices [m]."""


class Network(Protocol):
    """A network with its inputs.

    Its history, what it remembers beside the `Trail`, is None or has the methods `advance` and `transform`, as
    `swingar.history.History` has.
    """

    def prepare(self, proxy: ProxyOnBody) -> Any:
        """Computes what the network needs of a garment and what does not change from frame to frame."""
        ...

    def start(self, pose: Pose) -> Any:
        """Returns the history of a body that has always stood in one pose."""
        ...

    def predict(self, prepared: Any, proxy: ProxyOnBody, trail: Trail, history: Any, posed: PosedBody) -> Prediction:
        """Predicts the proxy on a posed body."""
        ...

    def arrays(self) -> Mapping[str, np.ndarray]:
        """Returns the weights of the network by their names in model files."""
        ...

    def extra(self) -> Mapping[str, Any]:
        """Returns what model files say of the network beside its weights."""
        ...
