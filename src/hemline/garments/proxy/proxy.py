"""The coarse garment that moves in the place of the one that is shown."""

import math
from typing import NamedTuple

import numpy as np

from hemline.arrays import Int
from hemline.garments.garment import Garment

from .coarser import coarser_garment

NEARLY = 0.9
"""A garment of which more than this share would be left is its own proxy."""


class ProxySize(NamedTuple):
    """How coarse it is."""

    edge: float = 0.035
    """Length of its edges [m]."""
    fewest: int = 500
    """Vertices that it has at least; all where the garment has no more."""
    most: int = 1500
    """Vertices that it has at most."""


def proxy_of(garment: Garment, size: ProxySize) -> tuple[Garment, Int[np.ndarray, " coarse"]]:
    r"""The garment with edges of about one length: $N = A / (\sqrt{3}/2 \; \ell^2)$ vertices for an area $A$.

    Args:
        garment: The one that is shown.
        size: Length of its edges, and how many vertices there may be.

    Returns:
        The coarse garment, the garment itself where that has hardly more vertices; and which vertex of the fine one
        each of its vertices is.
    """
    one, two = garment.rest_edges[:, :, 0], garment.rest_edges[:, :, 1]
    area = 0.5 * float(np.abs(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]).sum())
    count = min(max(area / (math.sqrt(0.75) * size.edge**2), size.fewest), size.most)
    share = count / len(garment.vertices)
    return coarser_garment(garment, share if share < NEARLY else 1.0)
