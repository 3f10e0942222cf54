"""The body that garments are tried on."""

import numpy as np
import pytest

from hemline import bodies
from hemline.garments import Garment, Material, Pins


@pytest.fixture(scope="session")
def shaped():
    return bodies.load("anny24").shaped()


@pytest.fixture
def patch():
    """Parts of a small garment: two triangles of 10 cm, one vertex pinned."""
    vertices = np.array([[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0], [0, 0.1, 0]], np.float32)
    pins = Pins(
        np.array([2], np.int32),
        np.array([7], np.int32),
        np.array([[0.2, 0.3, 0.5]], np.float32),
        np.array([0.004], np.float32),
    )
    return {
        "name": "patch",
        "vertices": vertices,
        "faces": np.array([[0, 1, 2], [0, 2, 3]], np.int32),
        "rest_edges": np.array([[[0.1, 0.1], [0, 0.1]], [[0.1, 0], [0.1, 0.1]]]),
        "material": Material.of("silk"),
        "pins": pins,
        "key_joint": "neck",
        "chains": ((0, 1), (3, 2)),
    }


@pytest.fixture
def small(patch):
    return Garment(**patch)
