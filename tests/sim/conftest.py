"""Sheets of cloth and simple bodies, made from nothing."""

import numpy as np
import pytest

from hemline.sim import Elastic, Scene, Sheet, make_sheet

NO_PINS = np.zeros((0, 3))


def grid(across: int, along: int, width: float, length: float):
    """A flat rectangle: flat coordinates (verts, 2), faces, rest edges; vertex (i, j) is number i * along + j."""
    u, v = np.meshgrid(np.linspace(0, width, across), np.linspace(0, length, along), indexing="ij")
    flat = np.stack([u.ravel(), v.ravel()], axis=1)
    number = np.arange(across * along).reshape(across, along)
    a, b, c, d = number[:-1, :-1].ravel(), number[1:, :-1].ravel(), number[1:, 1:].ravel(), number[:-1, 1:].ravel()
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype(np.int32)
    rest = np.stack([flat[faces[:, 1]] - flat[faces[:, 0]], flat[faces[:, 2]] - flat[faces[:, 0]]], axis=2)
    return flat, faces, rest


@pytest.fixture
def square():
    """A function that makes a square sheet and its positions in the plane y = 0."""

    def make(count: int, size: float = 1.0, *, curved: float = 0.0, **material) -> tuple[Sheet, np.ndarray]:
        flat, faces, rest = grid(count, count, size, size)
        positions = np.stack([flat[:, 0], curved * np.sin(3 * flat[:, 0]), flat[:, 1]], axis=1)
        shape = positions if curved else None
        return make_sheet(faces, rest, Elastic(**material), rest_vertices=shape), positions

    return make


@pytest.fixture
def free():
    """A scene without pins and without a body."""
    return lambda share: Scene(NO_PINS)
