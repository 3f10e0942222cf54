"""Energy of contact as a function of depth, and of friction as a function of slip, for one vertex or one pair."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from hemline.compiled import kernel

from .planes import Planes


class SkinContact(NamedTuple):
    """Contact and friction of each vertex with a plane of the body.

    Attributes:
        normal, point, carried, stiffness: The plane under each vertex, see `Planes`. They are separate fields because
            tuples within tuples cost kernels microseconds to unpack.
        limit: Largest friction force on each vertex, from its load at the start of the step [N].
        thickness: Distance that cloth keeps from the body [m].
        depth: Penetration beyond which the load is constant [m].
        creep: Slip below which friction is smoothed [m].
    """

    normal: Float[np.ndarray, "verts 3"]
    point: Float[np.ndarray, "verts 3"]
    carried: Float[np.ndarray, "verts 3"]
    stiffness: Float[np.ndarray, " verts"]
    limit: Float[np.ndarray, " verts"]
    thickness: float
    depth: float
    creep: float

    @property
    def planes(self) -> Planes:
        """Planes of the body under the vertices."""
        return Planes(self.normal, self.point, self.carried, self.stiffness)

    def on(self, planes: Planes) -> "SkinContact":
        """Returns this contact on other planes."""
        return SkinContact(*planes, self.limit, self.thickness, self.depth, self.creep)


@kernel(inline="always")
def contact_terms(gap, stiffness, depth):
    """Computes contact with the body.

    Reads: gap: height over the contact distance [m]; stiffness [N/m]; depth: from which on the load is constant [m].
    Returns: The energy [J], the load, which is the force along the normal [N], and the stiffness [N/m].
    """
    if gap >= 0.0 or stiffness == 0.0:
        return 0.0, 0.0, 0.0
    if gap > -depth:
        return 0.5 * stiffness * gap * gap, -stiffness * gap, stiffness
    load = stiffness * depth
    return load * (-gap - 0.5 * depth), load, load / -gap


@kernel(inline="always")
def slip_terms(slip, creep):
    """Computes the smoothed Coulomb potential for a limit of 1 N (Li et al. 2020, Eq. 14).

    Reads: slip: length of the slip u [m]; creep: slip below which friction is smoothed [m].
    Returns: The potential [J/N], and its derivative divided by u [1/m].
    """
    if slip < creep:
        ratio = slip / creep
        return creep * (ratio * ratio * (1.0 - ratio / 3.0) + 1.0 / 3.0), (2.0 - ratio) / creep
    return slip, 1.0 / slip


@kernel(inline="always")
def press_terms(depth, stiffness, thickness):
    """Computes contact of a pair.

    Reads: depth: how much closer the pair is than its reach [m]; stiffness [N/m]; thickness: depth from which on the
        load is constant [m].
    Returns: The energy [J], the load [N], and the stiffness [N/m].
    """
    if depth <= 0.0:
        return 0.0, 0.0, 0.0
    if depth < thickness:
        load = stiffness * depth * depth / thickness
        return load * depth / 3.0, load, 2.0 * stiffness * depth / thickness
    load = stiffness * thickness
    return load * (depth - 2.0 / 3.0 * thickness), load, load / depth


__all__ = ["SkinContact", "contact_terms", "press_terms", "slip_terms"]
