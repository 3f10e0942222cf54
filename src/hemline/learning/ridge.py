"""Ridge regression: the linear map that is best on inputs with noise."""

import numpy as np

from hemline.arrays import Float


def ridge(
    inputs: Float[np.ndarray, "frames ins"],
    outputs: Float[np.ndarray, "frames outs"],
    noise: Float[np.ndarray, " ins"],
    weights: Float[np.ndarray, " frames"] | None = None,
) -> tuple[Float[np.ndarray, "outs ins"], Float[np.ndarray, " outs"]]:
    r"""The linear map with the least mean square error on inputs that carry noise.

    $$A = C_{yx} (C_{xx} + \mathrm{diag}(\sigma^2))^{-1}, \qquad a = \bar y - A \bar x$$

    Args:
        inputs: Inputs $x$.
        outputs: Outputs $y$.
        noise: Standard deviation $\sigma$ of the noise on each input.
        weights: How much each frame counts; None: all the same.

    Returns:
        $A$ and $a$, float64.

    Source: Bishop, "Training with noise is equivalent to Tikhonov regularization", 1995.
    """
    x, y = inputs.astype(np.float64), outputs.astype(np.float64)
    share = np.full(len(x), 1 / len(x)) if weights is None else weights / weights.sum()
    x_mean, y_mean = share @ x, share @ y
    x, y = x - x_mean, y - y_mean
    counted = x.T * share
    matrix = np.linalg.solve(counted @ x + np.diag(noise.astype(np.float64) ** 2), counted @ y).T
    return matrix, y_mean - matrix @ x_mean
