"""Moves a garment from one shape of a body onto another."""

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Faces, Float, Vertices
from hemline.meshes import ClosestTree

from .clearance import push_out_of_body, smooth_field
from .pins import Pins

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

CLEARANCE = 0.003
"""Least distance between cloth and skin at the start [m]."""
_FOLLOW_DISTANCE = 0.05
"""Distance from the skin beyond which cloth hardly follows it [m]."""


@lru_cache(maxsize=4)
def body_tree(shaped: "ShapedBody") -> ClosestTree:
    """Returns a search tree over the surface of a body at rest, cached."""
    return ClosestTree(np.asarray(shaped.vertices, np.float64), shaped.body.faces)


def dress_vertices(
    vertices: Vertices,
    faces: Faces,
    rest_edges: Float[np.ndarray, "faces 2 2"],
    pins: Pins,
    original_body: "ShapedBody",
    shaped: "ShapedBody",
) -> Vertices:
    """Returns the start positions of a garment on another shape of its body.

    Each vertex moves with the point of the body nearest to it. This counts less for vertices farther from the skin:
    displacements are smoothed over the mesh with the weight exp(-(d / 5 cm)^2). Pins go where they are bound.
    Finally the cloth is moved out of the body.

    Args:
        vertices: The garment on its own body [m].
        faces: Its triangles.
        rest_edges: Its flat rest triangles [m].
        pins: Its pins.
        original_body: The body that it was made on.
        shaped: Another shape of that body.

    Returns:
        Positions [m], float64.
    """
    before, after = body_tree(original_body), body_tree(shaped)
    closest = before.closest(vertices)
    moved = np.einsum("pc,pcx->px", closest.weights, after.corners[closest.faces])
    trust = np.exp(-((closest.distances / _FOLLOW_DISTANCE) ** 2)) + 1e-3
    displacement = moved - closest.positions
    pinned = np.zeros(len(vertices), bool)
    pinned[pins.vertices] = True
    at_pins = pins.positions(shaped.vertices, shaped.normals, shaped.body.faces, shaped.joints)
    displacement[pins.vertices] = at_pins - vertices[pins.vertices]
    trust[pinned] = 1e6
    spacing = float(np.sqrt(np.linalg.norm(rest_edges, axis=1)).mean()) ** 2
    smooth = smooth_field(displacement, faces, trust, (_FOLLOW_DISTANCE / spacing) ** 2 / 4)
    smooth[pinned] = displacement[pinned]
    return push_out_of_body(vertices + smooth, after, CLEARANCE, fixed=pinned)
