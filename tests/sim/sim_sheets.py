"""Flat grids that sheets and garments of tests are made of."""

import numpy as np


def grid(across: int, along: int, width: float, length: float):
    """A flat rectangle: flat coordinates (verts, 2), faces, rest edges; vertex (i, j) is number i * along + j."""
    u, v = np.meshgrid(np.linspace(0, width, across), np.linspace(0, length, along), indexing="ij")
    flat = np.stack([u.ravel(), v.ravel()], axis=1)
    number = np.arange(across * along).reshape(across, along)
    a, b, c, d = number[:-1, :-1].ravel(), number[1:, :-1].ravel(), number[1:, 1:].ravel(), number[:-1, 1:].ravel()
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype(np.int32)
    rest = np.stack([flat[faces[:, 1]] - flat[faces[:, 0]], flat[faces[:, 2]] - flat[faces[:, 0]]], axis=2)
    return flat, faces, rest
