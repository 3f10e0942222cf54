"""What was learned: a network, the options of its fit and its figures, as model files hold them."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Self

import numpy as np

from hemline.animators.swingar.features.proxy_on_body import DYNAMIC, STATIC
from hemline.animators.swingar.graph.estimator_config import EstimatorConfig
from hemline.animators.swingar.graph.runtime import PlayedEstimator
from hemline.animators.swingar.lag.lag_net import LagNet, layer_sizes
from hemline.errors import BadModel
from hemline.files.contents import AGAIN, array_of, entry, part
from hemline.options import options_of

from .config import SwingarConfig
from .mover import GraphMover, LagMover, Mover
from .relatives import Relatives

VERSION = 2
"""Of what a model file holds under `swingar`."""


@dataclass(frozen=True, eq=False)
class Weights:
    """A network and where it comes from."""

    config: SwingarConfig
    mover: Mover
    relatives: Relatives
    """The garments of the fit."""
    figures: Mapping[str, float]
    licences: Sequence[str]

    def arrays(self) -> dict[str, np.ndarray]:
        """By name."""
        return dict(self.mover.arrays()) | self.relatives.arrays()

    def extra(self) -> dict[str, Any]:
        """Metadata of the animator's own."""
        own: dict[str, Any] = {"version": VERSION, "garments": list(self.relatives.names)}
        if isinstance(self.mover, GraphMover):
            own["estimator"] = asdict(self.mover.estimator.config)
        return {"swingar": own}

    def rounded(self) -> Self:
        """As a file gives them back."""
        metadata = {"config": asdict(self.config), "figures": dict(self.figures), "licences": list(self.licences)}
        return self.of(self.arrays(), metadata | self.extra())

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> Self:
        """From a model file.

        Raises:
            BadModel: The file is of another version, a key is missing or of another type, or an array of another dtype
                or shape than the options ask.
        """
        own = entry(metadata, "swingar", dict)
        version = own.get("version")
        if version != VERSION:
            raise BadModel(f"this hemline reads version {VERSION} of swingar", f"version {version}", AGAIN)
        config = options_of(SwingarConfig, entry(metadata, "config", dict), error=BadModel)
        mover = _lag(arrays, config) if config.learner == "lag" else _graph(arrays, own)
        relatives = Relatives.of(arrays, own)
        licences = [str(each) for each in entry(metadata, "licences", list)]
        return cls(config, mover, relatives, entry(metadata, "figures", dict), licences)


def _lag(arrays: Mapping[str, np.ndarray], config: SwingarConfig) -> LagMover:
    weights, biases = {}, {}
    for name, (inputs, outputs) in layer_sizes(STATIC + DYNAMIC, config.width).items():
        weights[name] = array_of(arrays, f"weight.{name}", "float16", (inputs, outputs)).astype(np.float32)
        biases[name] = array_of(arrays, f"bias.{name}", "float32", (outputs,))
    return LagMover(LagNet(weights, biases))


def _graph(arrays: Mapping[str, np.ndarray], own: Mapping[str, Any]) -> GraphMover:
    config = options_of(EstimatorConfig, entry(own, "estimator", dict), error=BadModel)
    return GraphMover(PlayedEstimator.of(config, part(arrays, "graph")))
