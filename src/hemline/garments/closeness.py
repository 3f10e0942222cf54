"""Whether a garment lies close to the body as a whole."""

import numpy as np

from hemline.bodies.body import ShapedBody

from .garment import Garment

CLOSE_DISTANCE, CLOSE_SHARE = 0.05, 0.9
"""Distance from the skin up to which a vertex lies close [m], and the fraction of the vertices that must. Of 23
garments tried on, T-shirts, trousers, jeans, shorts and tops are close by it; skirts, dresses, capes, a robe, an open
jacket and wide trousers are not."""


def lies_close(garment: Garment, shaped: ShapedBody) -> bool:
    """Returns whether nearly all of a garment lies close to the skin at rest.

    Args:
        garment: The garment.
        shaped: The body that it was made for.
    """
    from scipy.spatial import KDTree

    distances = KDTree(shaped.vertices).query(garment.vertices)[0]
    return bool(np.mean(distances <= CLOSE_DISTANCE) >= CLOSE_SHARE)
