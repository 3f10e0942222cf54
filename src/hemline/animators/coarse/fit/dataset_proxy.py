"""The garment of a dataset on a body, as its proxy."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hemline import bodies
from hemline.animators.coarse.beginning import opening_simulator
from hemline.animators.coarse.proxy_on_body import ProxyOnBody
from hemline.animators.simulated_proxy import SimulatedProxy
from hemline.arrays import Int
from hemline.datasets import Dataset
from hemline.garments.proxy.proxy import ProxySize, proxy_of


@dataclass(frozen=True, eq=False)
class DatasetProxy:
    """The garment of a dataset on a body, as its proxy."""

    proxy: ProxyOnBody
    vertex_ids: Int[np.ndarray, " coarse"]
    """Which vertex of the dataset's garment each of its vertices is."""

    @cached_property
    def simulator(self) -> SimulatedProxy:
        """What simulates it at the beginning of a take."""
        return opening_simulator(self.proxy)


def proxy_of_dataset(dataset: Dataset, betas: Sequence[float], size: ProxySize) -> DatasetProxy:
    """The garment of a dataset on a body, settled.

    Args:
        dataset: Takes of the garment or of its proxy.
        betas: Shape of the body.
        size: Of proxies.
    """
    shaped = bodies.load(dataset.garment.body_name).shaped(tuple(betas))
    coarse, kept = proxy_of(dataset.garment, size)
    rest = dataset.rest(shaped.betas).vertices[0][kept]
    return DatasetProxy(ProxyOnBody.of(coarse.dressed(shaped), rest, shaped), kept)
