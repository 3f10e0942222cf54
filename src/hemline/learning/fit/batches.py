"""Random noise and random vertices for each batch of a training."""

import numpy as np

from hemline.arrays import Float, Int

SMALLEST_DEVIATION = 0.005
"""Least deviation that inputs are divided by, so that nearly constant ones are not amplified [m]."""


def with_noise(
    inputs: Float[np.ndarray, "batch ins"],
    deviation: float,
    free: Float[np.ndarray, " ins"],
    random: np.random.Generator,
) -> Float[np.ndarray, "batch ins"]:
    """Returns inputs with normal noise added, float32.

    Args:
        inputs: Inputs of a batch, float32.
        deviation: Standard deviation of the noise.
        free: 1 for inputs that get noise, 0 for others.
        random: Random number generator.
    """
    noise = random.standard_normal(inputs.shape, np.float32) * np.float32(deviation)
    return inputs + noise * free


def sample_vertices(
    vertex_count: int, most: int, random: np.random.Generator
) -> tuple[Int[np.ndarray, " some"], Int[np.ndarray, " rows"]]:
    """Draws some vertices of a mesh, ascending, and the rows of their three coordinates; means over them are unbiased.

    Args:
        vertex_count: Vertices of the mesh.
        most: Number to draw; all vertices if there are fewer.
        random: Random number generator.
    """
    vertices = np.sort(random.choice(vertex_count, min(most, vertex_count), replace=False))
    return vertices, (3 * vertices[:, None] + np.arange(3)).reshape(-1)
