"""How far apart two bodies are, as far as a garment is concerned."""

import numpy as np

from hemline.arrays import Float, Int
from hemline.bodies.body import ShapedBody

SHAPE_POWER = 0.75
"""Of how much the betas move the skin, squared and summed; as of the joints in distances between poses."""


def shape_scale(
    shaped: ShapedBody, nearest: Int[np.ndarray, " verts"], power: float = SHAPE_POWER
) -> Float[np.ndarray, "betas betas"]:
    r"""What betas are multiplied by before bodies are compared: $|S (\beta - \beta')|$ is how far apart they are.

    $S^2 \propto M^{3/4}$, $M_{ij} = \sum_v (n_v \cdot d_{i,v}) (n_v \cdot d_{j,v})$, with $d_{i,v}$ how far beta i
    moves the skin under vertex v of the garment, and $n_v$ its normal. So a beta of the hand tells bodies apart under a
    glove and not under trousers, and two betas that undo each other leave them alike. The trace of $S^2$ is the number
    of betas. Where no beta moves that skin, they count alike.

    Args:
        shaped: The body that the garment was made on, whose normals are taken.
        nearest: Vertex of the body under each of the garment's.
        power: In the place of 3/4.

    Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations", 2021,
        Eq. 7, which weighs the turns of joints so. Differs: there shapes are told apart by a regression on betas alone.
    """
    out = np.einsum("bvi,vi->bv", shaped.body.shapedirs[:, nearest].astype(np.float64), shaped.normals[nearest])
    found, axes = np.linalg.eigh(out @ out.T)
    if not found.max(initial=0) > 0:
        return np.eye(len(out))
    scale = (axes * np.maximum(found, 0) ** (power / 2)) @ axes.T
    return scale * np.sqrt(len(scale) / (scale**2).sum())
