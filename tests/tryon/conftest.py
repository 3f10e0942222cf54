"""A body, and the shipped clothes as files of somebody else."""

from pathlib import Path

import numpy as np
import pytest

from hemline import bodies, garments

DATA = Path(__file__).resolve().parents[2] / "../shared/data/garments"


@pytest.fixture(scope="session")
def shaped():
    return bodies.load("anny24").shaped()


@pytest.fixture(scope="session")
def worn():
    """The T-shirt and the trousers that ship."""
    return {name: garments.load(f"{name}-light") for name in ("tshirt", "trousers")}


@pytest.fixture
def as_obj(tmp_path):
    """Write a mesh as an OBJ."""

    def write(name, vertices, faces):
        path = tmp_path / f"{name}.obj"
        lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in np.asarray(vertices, float).tolist()]
        lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces.tolist()]
        path.write_text("\n".join(lines) + "\n")
        return path

    return write


@pytest.fixture
def mesh_of():
    """A garment file of the shared folder, or a skip that says so."""

    def path(name):
        file = DATA / name
        if not file.exists():
            pytest.skip(f"no garments at {DATA}")
        return file

    return path
