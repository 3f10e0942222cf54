"""The proxy of the garment of a dataset on a body."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hemline.animators.coarse.beginning import opening_simulator
from hemline.animators.coarse.proxy_on_body import ProxyOnBody
from hemline.animators.simulated_proxy import SimulatedProxy
from hemline.arrays import Int
from hemline.datasets import Dataset
from hemline.garments.proxy.proxy import ProxySize, proxy_of


@dataclass(frozen=True, eq=False)
class DatasetProxy:
    """The proxy of the garment of a dataset on a body."""

    proxy: ProxyOnBody
    """The settled proxy."""
    vertex_ids: Int[np.ndarray, " coarse"]
    """Index in the dataset's garment of each vertex of the proxy."""

    @cached_property
    def simulator(self) -> SimulatedProxy:
        """Simulates the proxy at the beginning of a take."""
        return opening_simulator(self.proxy)


def proxy_of_dataset(dataset: Dataset, betas: Sequence[float], size: ProxySize) -> DatasetProxy:
    """Returns the proxy of the garment of a dataset, settled on a body.

    Args:
        dataset: Takes of the garment or of its proxy.
        betas: Shape of the body.
        size: Size of the proxy.
    """
    shaped = dataset.body.shaped(tuple(betas))
    coarse, kept = proxy_of(dataset.garment, size)
    rest = dataset.rest(shaped.betas).vertices[0][kept]
    return DatasetProxy(ProxyOnBody.of(coarse.dressed(shaped), rest, shaped), kept)
