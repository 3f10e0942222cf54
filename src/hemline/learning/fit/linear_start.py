"""Initialises a rectified network as a given linear map."""

import numpy as np

from hemline.arrays import Float


def as_network(
    matrix: Float[np.ndarray, "outs ins"],
    offset: Float[np.ndarray, " outs"],
    layers: list[tuple[np.ndarray, np.ndarray]],
) -> None:
    r"""Writes a linear map into the layers of a rectified network, which then computes it exactly.

    With $A = U S V^T$, pairs of neurons carry $\pm\sqrt{S_k} v_k \cdot x$ through both hidden layers, since
    $\mathrm{relu}(z) - \mathrm{relu}(-z) = z$. The remaining neurons keep their weights, but have no output at first.
    If the rank of the map exceeds half the number of neurons, its largest singular values are used.

    Args:
        matrix: $A$.
        offset: Offset of the outputs.
        layers: Weights (outs, ins) and biases of three layers; changed in place.
    """
    left, sizes, right = np.linalg.svd(matrix, full_matrices=False)
    (first, first_bias), (second, second_bias), (last, last_bias) = layers
    rank = min(len(sizes), len(first) // 2, len(second) // 2)
    plus, minus = np.arange(0, 2 * rank, 2), np.arange(1, 2 * rank, 2)
    root = np.sqrt(sizes[:rank, None])
    first[plus], first[minus] = root * right[:rank], -root * right[:rank]
    second[: 2 * rank] = 0
    for sign, here in ((1, plus), (-1, minus)):
        second[here, plus], second[here, minus] = sign, -sign
    last[:] = 0
    last[:, plus], last[:, minus] = left[:, :rank] * root.T, -left[:, :rank] * root.T
    first_bias[: 2 * rank] = 0
    second_bias[: 2 * rank] = 0
    last_bias[:] = offset
