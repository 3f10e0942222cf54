"""Garments out of files of strangers whose pins hang on what the body has not."""

import numpy as np
import pytest

from hemline import bodies, garments
from hemline.errors import BadGarment
from hemline.files import write_tensors
from hemline.garments import Garment


@pytest.fixture(scope="module")
def shaped():
    return bodies.load("anny24").shaped()


@pytest.fixture
def pinned_beyond(tmp_path, shaped):
    """A file of a cape with one pin on a triangle after the body's last."""
    cape = garments.make_cape(shaped, rows=6, columns=10, name="napkin")
    arrays = {name: np.array(array) for name, array in cape.arrays().items()}
    arrays["pin_body_faces"][0] = len(shaped.body.faces)
    write_tensors(tmp_path / "napkin.safetensors", arrays, {"kind": "garment"} | cape.metadata())
    return tmp_path / "napkin.safetensors"


def test_a_pin_on_a_triangle_that_the_body_has_not_is_refused_where_they_meet(pinned_beyond, shaped):
    message = (
        "garment 'napkin': pins name a body face that does not exist; got 26692; anny24 has 26692; make the garment"
    )
    found = Garment.load(pinned_beyond)
    for shape in (shaped, shaped.body.shaped([1.0])):
        with pytest.raises(BadGarment, match=message):
            found.dressed(shape)
        with pytest.raises(BadGarment, match=message):
            garments.read(pinned_beyond, shape)
        with pytest.raises(BadGarment, match=message):
            found.check_pins_on(shape)


def test_a_garment_without_pins_hangs_on_nothing(shaped):
    cape = garments.make_cape(shaped, rows=6, columns=10, name="napkin")
    none = {"pin_" + name: array[:0] for name, array in vars(cape.pins).items() if isinstance(array, np.ndarray)}
    arrays = {name: none.get(name, array) for name, array in cape.arrays().items()}
    Garment.of(arrays, cape.metadata()).check_pins_on(shaped)
