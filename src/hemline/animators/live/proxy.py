"""The coarse garment that is simulated in the place of the one that is shown."""

import math

import numpy as np

from hemline.arrays import Int
from hemline.garments import Garment, coarser_garment

from .config import LiveConfig


def proxy_of(garment: Garment, config: LiveConfig) -> tuple[Garment, Int[np.ndarray, " coarse"]]:
    r"""The garment with edges of about one length: $N = A / (\sqrt{3}/2 \; \ell^2)$ vertices for an area $A$.

    Args:
        garment: The one that is shown.
        config: Length of an edge, and how many vertices there may be.

    Returns:
        The coarse garment, the garment itself where that has no more vertices; and which vertex of the fine one each
        of its vertices is.
    """
    one, two = garment.rest_edges[:, :, 0], garment.rest_edges[:, :, 1]
    area = 0.5 * float(np.abs(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]).sum())
    asked = area / (math.sqrt(0.75) * config.edge**2)
    count = min(max(asked, config.fewest), config.most)
    return coarser_garment(garment, min(1.0, count / len(garment.vertices)))
