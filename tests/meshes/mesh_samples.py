"""Small meshes for the tests of this room."""

import numpy as np


def grid(rows, columns, *, width=1.0, height=1.0, jitter=0.0, seed=0):
    """A flat sheet in the xy plane, inner vertices moved at random by up to `jitter` of a cell."""
    x, y = np.meshgrid(np.linspace(0, width, columns), np.linspace(0, height, rows))
    vertices = np.stack([x, y, np.zeros_like(x)], axis=-1)
    rng = np.random.default_rng(seed)
    moved = jitter * rng.uniform(-1, 1, (rows - 2, columns - 2, 2)) * (width / (columns - 1), height / (rows - 1))
    vertices[1:-1, 1:-1, :2] += moved
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    flip = rng.random(a.shape) < 0.5
    first = np.where(flip[..., None], np.stack([a, b, c], -1), np.stack([a, b, d], -1))
    second = np.where(flip[..., None], np.stack([a, c, d], -1), np.stack([b, c, d], -1))
    faces = np.concatenate([first.reshape(-1, 3), second.reshape(-1, 3)])
    return vertices.reshape(-1, 3), faces.astype(np.int32)


def sphere(subdivisions=3, radius=1.0):
    """A closed icosphere."""
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions, radius)
    return np.array(ball.vertices, np.float64), np.array(ball.faces, np.int32)
