"""Relaxes close garments that are torn at rest, as a mesh may be that was stretched over a body, not settled on it."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from hemline.collide.surface.garment_on_body import GarmentOnBody
from hemline.garments.closeness import lies_close
from hemline.meshes import edge_strains

from .close_cloth import CloseCloth

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody
    from hemline.garments import Garment

TORN = 0.3
"""Stretch that one in a hundred edges exceeds in a garment that is torn at rest."""
LONGEST = 1.08
"""Longest length of an edge over its length on the pattern, in a relaxed garment."""
PASSES = 12
"""Number of passes of the close-cloth loop."""


def relax_torn(garment: "Garment", shaped: "ShapedBody") -> "Garment":
    """Returns a close garment with edges little longer than on its pattern, outside the body in its rest pose.

    What an animator carries along with the body keeps its shape at rest, and so would keep edges that are torn there.

    Args:
        garment: The garment as it lies on the body.
        shaped: The body.

    Returns:
        The garment; the same object if less than one in a hundred of its edges is stretched by more than 30 %, or if
        it does not lie close to the body, see `lies_close`.
    """
    strains = edge_strains(garment.vertices, garment.faces, garment.rest_edges)
    if np.percentile(strains, 99) <= TORN or not lies_close(garment, shaped):
        return garment
    on_body = GarmentOnBody.of(shaped, garment.vertices)
    cloth, posed = CloseCloth.prepare(shaped, garment, on_body, stretch=LONGEST), shaped.posed(shaped.rest_pose)
    vertices, pattern = garment.vertices, np.zeros_like(garment.vertices)
    for _ in range(PASSES):
        vertices, _ = cloth.step(posed, vertices, pattern)
    return replace(garment, vertices=vertices)
