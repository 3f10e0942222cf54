"""What moves a proxy: a network with its inputs."""

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np

from hemline.animators.coarse.features.trail import Trail
from hemline.arrays import Float
from hemline.bodies import PosedBody
from hemline.motions.motion import Pose

from .proxy_on_body import ProxyOnBody

Prediction = tuple[Any, Float[np.ndarray, "coarse 3"]]
"""What is remembered, and where the proxy's vertices are [m]."""


class Network(Protocol):
    """A network with its inputs.

    What it remembers beside the `Trail` has methods `followed` and `moved`, as `swingar.history.History`; or is None.
    """

    def prepare(self, proxy: ProxyOnBody) -> Any:
        """What it knows of a garment once and for all."""
        ...

    def start(self, pose: Pose) -> Any:
        """What it remembers of a body that has always stood so."""
        ...

    def predict(self, prepared: Any, proxy: ProxyOnBody, trail: Trail, history: Any, posed: PosedBody) -> Prediction:
        """The proxy on a posed body."""
        ...

    def arrays(self) -> Mapping[str, np.ndarray]:
        """Weights of the network by name, as model files hold them."""
        ...

    def extra(self) -> Mapping[str, Any]:
        """What model files say of it beside its weights."""
        ...
