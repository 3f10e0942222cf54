"""What was learned: a network, the options of its fit and its figures, as model files hold them."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Protocol, Self

import numpy as np

from hemline.errors import BadModel
from hemline.files.contents import AGAIN, entry
from hemline.options import options_of

from .config import CoarseConfig
from .network import Network
from .relatives import Relatives


class NetworkReader(Protocol):
    """A kind of animator whose network is found in model files."""

    name: str
    version: int
    """Version of what its model files hold under its name."""
    Config: type[CoarseConfig]

    def network_of(self, arrays: Mapping[str, np.ndarray], config: Any, own: Mapping[str, Any]) -> Network:
        """The network of a model file.

        Args:
            arrays: By name.
            config: The options of its fit.
            own: What the file says of it beside its weights.

        Raises:
            BadModel: An array is missing, or of another dtype or shape than the options ask.
        """
        ...


@dataclass(frozen=True, eq=False)
class Weights:
    """A network and where it comes from."""

    kind: NetworkReader
    config: CoarseConfig
    network: Network
    relatives: Relatives
    """The garments of the fit."""
    figures: Mapping[str, float]
    licences: Sequence[str]

    def arrays(self) -> dict[str, np.ndarray]:
        """By name."""
        return dict(self.network.arrays()) | self.relatives.arrays()

    def extra(self) -> dict[str, Any]:
        """Metadata of the animator's own."""
        own = {"version": self.kind.version, "garments": list(self.relatives.names)}
        return {self.kind.name: own | dict(self.network.extra())}

    def as_stored(self) -> Self:
        """The same weights, rounded as a model file stores them."""
        metadata = {"config": asdict(self.config), "figures": dict(self.figures), "licences": list(self.licences)}
        return self.of(self.kind, self.arrays(), metadata | self.extra())

    @classmethod
    def of(cls, kind: NetworkReader, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> Self:
        """From a model file.

        Raises:
            BadModel: The file is of another version, a key is missing or of another type, or an array of another dtype
                or shape than the options ask.
        """
        own = entry(metadata, kind.name, dict)
        version = own.get("version")
        if version != kind.version:
            raise BadModel(f"this hemline reads version {kind.version} of {kind.name}", f"version {version}", AGAIN)
        config = options_of(kind.Config, entry(metadata, "config", dict), error=BadModel)
        licences = [str(each) for each in entry(metadata, "licences", list)]
        network, relatives = kind.network_of(arrays, config, own), Relatives.of(arrays, own)
        return cls(kind, config, network, relatives, entry(metadata, "figures", dict), licences)
