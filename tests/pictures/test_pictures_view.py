"""The view from which most of a garment is seen: closed forms, and the clothes that ship."""

import time

import numpy as np
import pytest

from hemline import bodies, garments
from hemline.errors import BadInput
from hemline.pictures import AUTO, VIEWS_DEG, clearest_view, draw, picture_of
from hemline.pictures.camera import ELEVATION_DEG
from hemline.pictures.view import PREFERRED_VIEWS, visible_area

SQUARE = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32)
FACES = np.array([[0, 1, 2], [0, 2, 3]], np.int32)


@pytest.fixture(scope="module")
def body():
    shaped = bodies.load("anny24").shaped()
    return shaped.vertices, shaped.body.faces


@pytest.mark.parametrize("view", VIEWS_DEG)
def test_the_area_of_a_square_is_that_of_its_shadow(view):
    shadow = 4 * abs(np.cos(np.radians(VIEWS_DEG[view]))) * np.cos(np.radians(ELEVATION_DEG))
    assert visible_area([(SQUARE, FACES)], [], view) == pytest.approx(shadow, abs=0.1)


def test_what_is_behind_something_is_not_seen():
    wall, behind = (2 * SQUARE, FACES), (SQUARE - np.float32([0, 0, 0.5]), FACES)
    assert visible_area([behind], [wall], "front") == 0
    assert visible_area([behind], [wall], "back") == pytest.approx(4 * np.cos(np.radians(ELEVATION_DEG)), rel=0.05)
    assert visible_area([], [], "front") == 0


def test_a_patch_before_the_chest_is_seen_from_the_front_and_one_behind_from_the_back(body):
    patch = 0.15 * SQUARE + np.float32([0, 0.3, 0])
    assert clearest_view([([(patch + np.float32([0, 0, 0.25]), FACES)], [body])]) in ("front", "three_quarter")
    assert clearest_view([([(patch - np.float32([0, 0, 0.25]), FACES)], [body])]) in ("back", "back_three_quarter")
    side = patch[:, [2, 1, 0]] + np.float32([0.7, 0, 0])
    assert clearest_view([([(side, FACES)], [body])]) == "side"


def test_the_cape_is_seen_from_behind_and_other_clothes_from_the_front(body):
    cape = garments.load("cape-light")
    assert clearest_view([([(cape.vertices, cape.faces)], [body])]) == "back_three_quarter"
    for name in ("tshirt-light", "skirt-light", "dress-light"):
        garment = garments.load(name)
        assert clearest_view([([(garment.vertices, garment.faces)], [body])]) == PREFERRED_VIEWS[0]


def test_several_frames_are_looked_at_together():
    turned = SQUARE[:, [2, 1, 0]]
    assert clearest_view([([(turned, FACES)], [])]) == "side"
    assert clearest_view([([(turned, FACES)], []), ([(SQUARE, FACES)], []), ([(SQUARE, FACES)], [])]) == "three_quarter"


def test_pictures_take_it_unless_a_view_is_named(body):
    cape = garments.load("cape-light")
    meshes = [(*body, "body"), (cape.vertices, cape.faces, "cloth")]
    size = (60, 80)
    assert np.array_equal(picture_of(meshes, size=size), picture_of(meshes, "back_three_quarter", size=size))
    both = picture_of(meshes, [AUTO, "front"], size=size)
    assert np.array_equal(both, picture_of(meshes, ["back_three_quarter", "front"], size=size))
    assert not np.array_equal(both[:, :60], both[:, 60:])
    assert picture_of([(*body, "body")], size=size).shape == (80, 60, 3)


def test_what_cannot_be_drawn_is_refused_before_it_is_looked_at(tmp_path):
    with pytest.raises(BadInput, match="a face points past the last vertex"):
        draw(tmp_path / "a.png", [(SQUARE, FACES + 1, "cloth")])


def test_it_costs_next_to_nothing(body):
    cape = garments.load("cape")
    frames = [([(cape.vertices, cape.faces)], [body])]
    clearest_view(frames)
    start = time.process_time()
    clearest_view(frames)
    assert time.process_time() - start < 0.5  # 0.05 s on a free core
