"""The registry entry of `lag`."""

from hemline.animators.coarse.kind import NetworkKind

from .config import LagConfig
from .lag_network import LagNetwork

KIND = NetworkKind(
    "lag",
    version=1,
    Config=LagConfig,
    network_of=LagNetwork.of,
    trainer="hemline.animators.lag.fit.fit_lag:fit_lag",
)
