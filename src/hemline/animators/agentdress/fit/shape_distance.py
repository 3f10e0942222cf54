"""The distance between two body shapes as it matters to a garment."""

import numpy as np

from hemline.arrays import Float, Int
from hemline.bodies.body import ShapedBody

SHAPE_POWER = 0.75
"""Exponent of the summed squared skin motion of the betas, equal to that of joints in distances between poses."""


def shape_scale(
    shaped: ShapedBody, nearest: Int[np.ndarray, " verts"], power: float = SHAPE_POWER
) -> Float[np.ndarray, "betas betas"]:
    r"""Returns the matrix $S$ for which $|S (\beta - \beta')|$ is the distance between two shapes.

    $S^2 \propto M^{3/4}$, $M_{ij} = \sum_v (n_v \cdot d_{i,v}) (n_v \cdot d_{j,v})$, where $d_{i,v}$ is the
    displacement by beta i of the skin under vertex v of the garment, and $n_v$ the normal there. A beta of the hand
    thus counts under a glove and not under trousers, and two betas that cancel leave bodies alike. The trace of $S^2$
    is the number of betas. If no beta moves that skin, all betas count alike.

    Args:
        shaped: The body of the garment, which supplies the normals.
        nearest: Closest body vertex of each garment vertex.
        power: Exponent, 3/4 by default.

    Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations", 2021,
        Eq. 7, which weights the rotations of joints in this way. Differs: the paper applies no distance to shapes.
    """
    along_normals = np.einsum(
        "bvi,vi->bv", shaped.body.shapedirs[:, nearest].astype(np.float64), shaped.normals[nearest]
    )
    values, axes = np.linalg.eigh(along_normals @ along_normals.T)
    if not values.max(initial=0) > 0:
        return np.eye(len(along_normals))
    scale = (axes * np.maximum(values, 0) ** (power / 2)) @ axes.T
    return scale * np.sqrt(len(scale) / (scale**2).sum())
