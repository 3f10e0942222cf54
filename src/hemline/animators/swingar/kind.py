"""The registry entry of `swingar`."""

from hemline.animators.coarse.kind import NetworkKind

from .config import SwingarConfig
from .graph_network import GraphNetwork

KIND = NetworkKind(
    "swingar",
    version=3,
    Config=SwingarConfig,
    network_of=GraphNetwork.of,
    trainer="hemline.animators.swingar.fit.fit_graph:fit_graph",
)
