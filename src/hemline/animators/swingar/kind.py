"""What the registry knows of `swingar`: its options, its fit, its model files."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from hemline.animators.coarse.kind import CoarseKind
from hemline.animators.coarse.network import Network
from hemline.errors import BadModel
from hemline.files.contents import entry, part
from hemline.options import options_of

from .config import SwingarConfig
from .estimator_config import EstimatorConfig
from .graph_network import GraphNetwork
from .runtime import RuntimeEstimator


class SwingarKind(CoarseKind):
    """SwinGar's estimator."""

    name = "swingar"
    version = 3
    Config = SwingarConfig

    def train(self, frames: Any, config: Any, **options: Any) -> tuple[Network, dict[str, float]]:
        """Learn, see `fit_graph.fit_graph`."""
        from hemline.animators.swingar.fit.fit_graph import fit_graph

        return fit_graph(frames, config, **options)

    def network_of(self, arrays: Mapping[str, np.ndarray], config: Any, own: Mapping[str, Any]) -> GraphNetwork:
        """The network of a model file; raises BadModel."""
        sizes = options_of(EstimatorConfig, entry(own, "estimator", dict), error=BadModel)
        return GraphNetwork(RuntimeEstimator.of(sizes, part(arrays, "graph")))


KIND = SwingarKind()
