"""Proxies: coarse garments that move in place of the ones that are displayed."""

import math
from typing import NamedTuple

import numpy as np

from hemline.arrays import Int
from hemline.garments.garment import Garment

from .coarser import coarser_garment

OWN_PROXY_FRACTION = 0.9
"""A garment is its own proxy if a proxy would keep more than this fraction of its vertices."""


class ProxySize(NamedTuple):
    """Size of a proxy."""

    edge: float = 0.035
    """Length of its edges [m]."""
    fewest: int = 500
    """Least number of vertices; all of the garment if it has fewer."""
    most: int = 1500
    """Largest number of vertices."""


def proxy_count(garment: Garment, size: ProxySize) -> int:
    r"""Returns the size of a proxy: $N = A / (\sqrt{3}/2 \; \ell^2)$ vertices for an area $A$, within the limits."""
    one, two = garment.rest_edges[:, :, 0], garment.rest_edges[:, :, 1]
    area = 0.5 * float(np.abs(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]).sum())
    count = min(max(area / (math.sqrt(0.75) * size.edge**2), size.fewest), size.most)
    return min(len(garment.vertices), round(count))


def proxy_of(garment: Garment, size: ProxySize) -> tuple[Garment, Int[np.ndarray, " coarse"]]:
    """Makes a proxy with edges of about one length, see `proxy_count`.

    Args:
        garment: The garment that is displayed.
        size: Length of the proxy's edges, and limits of its number of vertices.

    Returns:
        The proxy, which is the garment itself if that has hardly more vertices; and for each of the proxy's vertices
        the number of that vertex in the garment.
    """
    fraction = proxy_count(garment, size) / len(garment.vertices)
    return coarser_garment(garment, fraction if fraction < OWN_PROXY_FRACTION else 1.0)
