"""What is drawn by chance for each batch of a training."""

import numpy as np

from hemline.arrays import Float, Int

SMALLEST_DEVIATION = 0.005
"""Inputs that hardly move are divided by at least this, so that they are not blown up [m]."""


def with_noise(
    inputs: Float[np.ndarray, "batch ins"],
    deviation: float,
    free: Float[np.ndarray, " ins"],
    random: np.random.Generator,
) -> Float[np.ndarray, "batch ins"]:
    """Inputs with normal noise added, float32.

    Args:
        inputs: Inputs of a batch, float32.
        deviation: Standard deviation of the noise.
        free: 1 where an input gets noise, 0 where it stays.
        random: What is drawn from.
    """
    noise = random.standard_normal(inputs.shape, np.float32) * np.float32(deviation)
    return inputs + noise * free


def drawn_vertices(
    vertex_count: int, most: int, random: np.random.Generator
) -> tuple[Int[np.ndarray, " some"], Int[np.ndarray, " rows"]]:
    """Some vertices of a mesh, in order, and the rows of their three coordinates; a mean over them is unbiased.

    Args:
        vertex_count: Vertices of the mesh.
        most: How many to draw; all where there are fewer.
        random: What is drawn from.
    """
    vertices = np.sort(random.choice(vertex_count, min(most, vertex_count), replace=False))
    return vertices, (3 * vertices[:, None] + np.arange(3)).reshape(-1)
