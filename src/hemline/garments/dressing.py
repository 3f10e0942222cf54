"""A garment moved from one shape of a body onto another."""

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Vertices
from hemline.meshes import ClosestTree

from .clearance import cleared, smoothed_field

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

    from .garment import Garment

CLEARANCE = 0.003
"""Least distance between cloth and skin at the start [m]."""
_NEAR = 0.05


@lru_cache(maxsize=4)
def body_tree(shaped: "ShapedBody") -> ClosestTree:
    """The surface of a body at rest, ready for questions of nearness."""
    return ClosestTree(np.asarray(shaped.vertices, np.float64), shaped.body.faces)


def dressed_vertices(garment: "Garment", shaped: "ShapedBody") -> Vertices:
    """Start positions of a garment on another shape of its body.

    Each vertex moves with the point of the body nearest to it. Vertices farther from the skin trust that point less:
    their way is smoothed over the mesh (weight exp(-(d / 5 cm)^2)). Pins go where they are bound; at last all is
    moved out of the body.

    Args:
        garment: The garment on its own body.
        shaped: Another shape of that body.

    Returns:
        Positions [m], float64.
    """
    before = body_tree(shaped.body.shaped(garment.body_betas))
    after = body_tree(shaped)
    closest = before.closest(garment.vertices)
    moved = np.einsum("pc,pcx->px", closest.weights, after.corners[closest.faces])
    trust = np.exp(-((closest.distances / _NEAR) ** 2)) + 1e-3
    way = moved - closest.positions
    pinned = np.zeros(len(garment.vertices), bool)
    pinned[garment.pins.vertices] = True
    at_pins = garment.pins.positions(shaped.vertices, shaped.normals, shaped.body.faces, shaped.joints)
    way[garment.pins.vertices] = at_pins - garment.vertices[garment.pins.vertices]
    trust[pinned] = 1e6
    spacing = float(np.sqrt(np.linalg.norm(garment.rest_edges, axis=1)).mean()) ** 2
    smooth = smoothed_field(way, garment.faces, trust, (_NEAR / spacing) ** 2 / 4)
    smooth[pinned] = way[pinned]
    return cleared(garment.vertices + smooth, after, CLEARANCE, fixed=pinned)
