"""Contact of the cloth's vertices with the body, and friction there."""

import numpy as np
from jaxtyping import Float

from hemline.sim.contact.body.load_kernels import SkinContact
from hemline.sim.contact.body.planes import Planes, no_planes
from hemline.sim.settings import SimSettings


def skin_contact(
    planes: Planes, limit: Float[np.ndarray, " verts"], settings: SimSettings, creep: float
) -> SkinContact:
    r"""Returns the contact of each vertex with one plane of the body, and Coulomb friction along it.

    $$E(x) = \sum_i \frac{k_i}{2} g_i^2 + \mu_i L_i\, f_0(|u_i|), \qquad g = \min(0,\; n \cdot (x - p) - t)$$

    in J, with $t$ the thickness; beyond a depth limit, the energy is linear instead of quadratic. $u$ is the slip along
    the plane from where the body would carry the vertex, $L$ the load of the step before, and $f_0$ is smooth below
    `creep`.
    Value, gradient and stiffness: `load_kernels.contact_terms` and `slip_terms`, called in `vertex_kernels.gradient`
    and `diagonal_blocks`.

    Args:
        planes: Planes of the body.
        limit: Largest friction force on each vertex, $\mu L$ [N].
        settings: Thickness and depth of contact.
        creep: Slip below which friction is smoothed [m].

    Source: Li et al., "Incremental potential contact", ACM TOG 39(4), 2020, Eq. 14, for friction. Differs: penalty
        contact with a plane, not a barrier, since cloth must be able to come out of a body that closed over it.
    """
    return SkinContact(*planes, limit, settings.thickness, settings.contact_depth, creep)


def no_contact(count: int, settings: SimSettings) -> SkinContact:
    """Returns contact for vertices that touch nothing."""
    return skin_contact(no_planes(count), np.zeros(count), settings, 1.0)
