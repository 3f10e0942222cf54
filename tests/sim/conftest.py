"""Sheets of cloth and simple bodies, made from nothing."""

import numpy as np
import pytest

from hemline.sim import Elastic, Sheet, StepScene, make_sheet
from tests.sim.sim_sheets import grid

NO_PINS = np.zeros((0, 3))


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
    return lambda share: StepScene(NO_PINS)
