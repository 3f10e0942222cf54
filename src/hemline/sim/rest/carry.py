"""Carries cloth along with the body's surface, from one shape and pose to another."""

from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from hemline.arrays import Faces
from hemline.garments.clearance import smooth_field
from hemline.sim.cloth.sheet import Positions
from hemline.sim.contact.body.friction_anchors import FrictionAnchors
from hemline.sim.contact.body.surface import BodySurface, MovingSkin

if TYPE_CHECKING:
    from hemline.bodies import PosedBody

TRUST_DISTANCE = 0.05
"""Distance from the skin at which cloth stops following the nearest triangle and follows its neighbours [m]."""

PELVIS_DISTANCE = 0.5
"""Distance from the skin from which on cloth follows the pelvis alone [m]."""


def carry_along(
    positions: Positions, faces: Faces, spacing: float, surface: BodySurface, first: "PosedBody", second: "PosedBody"
) -> Positions:
    """Returns where the body takes a garment that it wears: a first guess, not an equilibrium.

    Each vertex rides in the frame of the triangle nearest to it. Vertices farther from the skin trust that triangle
    less: their displacement relative to the pelvis is smoothed over the mesh (weight exp(-(d / 5 cm)^2)), as in
    `Garment.dressed`.

    Args:
        positions: The cloth on the first body [m].
        faces: Triangles of the cloth.
        spacing: Mean edge length of the cloth [m].
        surface: Topology of the body.
        first: The body that wears the cloth.
        second: The same body in another shape or pose.
    """
    skins = [MovingSkin(each.vertices, each.normals) for each in (first, second)]
    no_vertex = np.zeros(len(positions), bool)
    closest = surface.closest(positions, skins[0], no_vertex, reach=PELVIS_DISTANCE)
    riding = FrictionAnchors.at(positions, closest.face, skins[0], surface.faces).points(skins[1], surface.faces)
    distance = np.linalg.norm(positions - first.vertices[closest.nearest], axis=1)
    trust = np.where(closest.face < 0, 0.0, np.exp(-((distance / TRUST_DISTANCE) ** 2))) + 1e-3
    rigid = _with_pelvis(positions, first, second)
    relative = np.where((closest.face < 0)[:, None], 0.0, riding - rigid)
    return rigid + smooth_field(relative, faces, trust, (TRUST_DISTANCE / spacing) ** 2 / 4)


def farthest_displacement(first: "PosedBody", second: "PosedBody", near: Float[np.ndarray, "points 3"]) -> float:
    """Returns the largest motion of the skin near some points of the first body, relative to the pelvis [m]."""
    from scipy.spatial import KDTree

    nearest = np.unique(KDTree(first.vertices).query(near)[1])
    before = _with_pelvis(first.vertices[nearest].astype(np.float64), first, second)
    return float(np.linalg.norm(second.vertices[nearest] - before, axis=1).max())


def _with_pelvis(points: Positions, first: "PosedBody", second: "PosedBody") -> Positions:
    """Moves points that are fixed to the pelvis of the first body to the second one."""
    turn = second.transforms[0, :, :3].astype(np.float64) @ first.transforms[0, :, :3].T.astype(np.float64)
    return (points - first.joints[0]) @ turn.T + second.joints[0]
