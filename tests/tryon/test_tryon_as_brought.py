"""Try-on of garments as people bring them: other units, several parts, what cannot be worn, and limits of time."""

import time

import numpy as np
import pytest

from hemline.errors import BadGarment
from hemline.garments.generate import generate_garment, plain_design
from hemline.garments.reading.source import GarmentSource
from hemline.tryon import try_on
from hemline.tryon.units_tried import better_unit


@pytest.fixture(scope="module")
def top(shaped):
    """A plain top of few vertices."""
    return generate_garment(plain_design("top"), shaped, vertex_count=400)


@pytest.mark.slow
def test_a_top_in_inches_is_worn_as_one_in_metres_is(shaped, top, as_obj):
    plain = try_on(as_obj("metres", top.vertices, top.faces), shaped)
    tried = try_on(as_obj("inches", top.vertices / 0.0254, top.faces), shaped)
    assert plain.fitness.reason is None and tried.fitness.reason is None
    assert np.linalg.norm(tried.garment.vertices - plain.garment.vertices, axis=1).mean() < 0.01
    assert "unit: inches, as it fits the body so" in tried.garment.notes
    assert not any(note.startswith("unit") for note in plain.garment.notes)


def test_a_unit_that_was_said_is_kept(shaped, top, as_obj):
    path = as_obj("said", top.vertices / 0.0254, top.faces)
    tried = try_on(path, shaped, unit="cm")
    assert tried.fitness.reason is not None


def test_what_no_limb_can_go_through_is_refused_before_the_simulation(shaped, top, as_obj):
    # a shirt whose openings are closed by a lid each: rims remain, but far from where limbs are
    vertices, faces = top.vertices.astype(float), top.faces
    sheet = vertices * (1, 1, 0.02)
    began = time.process_time()
    tried = try_on(as_obj("flat", sheet, faces), shaped)
    if tried.growth is None:
        assert tried.fitness.reason.startswith("the body goes through its cloth at the ")
        assert "at any place, size and pose that was tried" in tried.fitness.reason
    assert tried.fitness.reason is not None and time.process_time() - began < 90


def test_the_time_is_limited_and_the_message_says_how_far_it_came(shaped, top, as_obj):
    path = as_obj("slow", top.vertices, top.faces)
    with pytest.raises(BadGarment, match=r"was not put on within 0 s of processor time; got 0 of \d+ frames in which"):
        try_on(path, shaped, seconds=0)


def test_the_first_word_comes_before_the_search(shaped, top, as_obj):
    said = []

    def stop(line):
        said.append(line)
        raise InterruptedError

    with pytest.raises(InterruptedError):
        try_on(as_obj("word", top.vertices, top.faces), shaped, say=stop)
    assert said[0].startswith(f"word: {len(top.vertices)} vertices, ") and "searching for its place" in said[0]


@pytest.mark.slow
def test_a_skirt_under_a_top_has_pins_of_its_own(shaped, top, as_obj):
    skirt = generate_garment(plain_design("skirt"), shaped, vertex_count=700)
    vertices = np.concatenate([top.vertices, skirt.vertices])
    faces = np.concatenate([top.faces, skirt.faces + len(top.vertices)])
    tried = try_on(as_obj("outfit", vertices, faces), shaped)
    assert tried.fitness.reason is None
    pinned = tried.garment.pins.vertices
    assert len(pinned) > 10 and pinned.min() >= len(top.vertices)
    assert any("none of the 1 that the shoulders carry" in note for note in tried.garment.notes)


def test_a_mesh_of_a_likely_size_in_metres_is_in_metres_however_it_fits(shaped, top, as_obj):
    long = top.vertices * (2.1 / np.ptp(top.vertices, axis=0).max())
    source = GarmentSource.open(as_obj("long", long, top.faces), None)
    assert source.unit == "m"
    assert better_unit(source, shaped, 99.0, poor=True) == "ft"  # once it is known that it cannot be worn
    assert better_unit(source, shaped, 99.0, poor=False) is None
