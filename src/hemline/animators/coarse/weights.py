"""A trained network with the options of its fit and its figures, as model files store them."""

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
    """A kind of animator that reads its network from model files, see `kind.NetworkKind`."""

    @property
    def name(self) -> str:
        """Name of the animator in model files."""
        ...

    @property
    def version(self) -> int:
        """Version of what its model files hold under its name."""
        ...

    @property
    def Config(self) -> type[CoarseConfig]:
        """Class of the options of its fit."""
        ...

    def network_of(self, arrays: Mapping[str, np.ndarray], config: Any, own: Mapping[str, Any], /) -> Network:
        """Reads the network.

        Args:
            arrays: Arrays of the file by name.
            config: Options of the fit.
            own: What the file says of the network beside its weights.

        Raises:
            BadModel: An array is missing or does not have the dtype or the shape that the options need.
        """
        ...


@dataclass(frozen=True, eq=False)
class Weights:
    """A network and its origin."""

    kind: NetworkReader
    """The kind of animator."""
    config: CoarseConfig
    """Options of the fit."""
    network: Network
    """The network."""
    relatives: Relatives
    """Garments of the fit."""
    figures: Mapping[str, float]
    """Figures of the fit, with their units in the names."""
    licences: Sequence[str]
    """Licence terms of the data of the fit."""

    def arrays(self) -> dict[str, np.ndarray]:
        """Returns the arrays of a model file by name."""
        return dict(self.network.arrays()) | self.relatives.arrays()

    def extra(self) -> dict[str, Any]:
        """Returns the metadata that a model file holds under the name of the animator."""
        own = {"version": self.kind.version, "garments": list(self.relatives.names)}
        return {self.kind.name: own | dict(self.network.extra())}

    def as_stored(self) -> Self:
        """Returns the weights rounded as a model file stores them."""
        metadata = {"config": asdict(self.config), "figures": dict(self.figures), "licences": list(self.licences)}
        return self.of(self.kind, self.arrays(), metadata | self.extra())

    @classmethod
    def of(cls, kind: NetworkReader, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> Self:
        """Reads the weights from the contents of a model file.

        Raises:
            BadModel: The file is of another version, a key is missing or of another type, or an array does not have the
                dtype or the shape that the options need.
        """
        own = entry(metadata, kind.name, dict)
        version = own.get("version")
        if version != kind.version:
            raise BadModel(f"this hemline reads version {kind.version} of {kind.name}", f"version {version}", AGAIN)
        config = options_of(kind.Config, entry(metadata, "config", dict), error=BadModel)
        licences = [str(each) for each in entry(metadata, "licences", list)]
        network, relatives = kind.network_of(arrays, config, own), Relatives.of(arrays, own)
        return cls(kind, config, network, relatives, entry(metadata, "figures", dict), licences)
