"""Colours, marks, the list of the worst frames, files."""

import numpy as np
import pytest

from hemline.collide import inside
from hemline.errors import BadInput
from hemline.view import Catalog, Choice, PlayedClip, SimulatedClip
from hemline.view.browser.bands import COLOURS, ERROR, STRETCH, split
from hemline.view.browser.downloads import clip_of, file_of
from hemline.view.browser.requests import Request, Requests
from hemline.view.stage.catalog import NO_MODEL
from hemline.view.stage.measures import (
    STAGES,
    FrameMeasures,
    cloth_of,
    errors,
    inside_body,
    measure_frame,
    stretches,
    worst_frames,
)
from tests.view.view_samples import catalog, clip, shirt, stage, take


def test_bands_are_the_mesh_taken_apart():
    garment = shirt().garment
    rng = np.random.default_rng(0)
    bands = rng.integers(0, len(COLOURS), len(garment.faces))
    parts = split(garment.vertices, garment.faces, bands)
    for band, part in enumerate(parts):
        assert part is not None
        vertices, faces = part
        assert np.array_equal(vertices[faces], garment.vertices[garment.faces[bands == band]])
    assert split(garment.vertices, garment.faces, np.zeros(len(garment.faces), int))[1:] == [None] * 4


def test_bands_begin_where_the_legend_says():
    assert STRETCH.bands(np.array([0.0, 4.9, 5.0, 19.9, 30.0, 99.0])).tolist() == [0, 0, 1, 2, 4, 4]
    assert [words for _, words in ERROR.legend] == [
        "below 5 mm",
        "5 to 10 mm",
        "10 to 20 mm",
        "20 to 50 mm",
        "above 50 mm",
    ]


def test_stretch_and_error_of_a_garment_that_was_scaled_and_moved():
    garment = shirt().garment
    wide = stretches(1.5 * garment.vertices, garment)
    assert (
        np.allclose(1 + wide / 100, 1.5 * (1 + stretches(garment.vertices, garment) / 100), atol=0.02)
        or (wide >= stretches(garment.vertices, garment)).all()
    )
    moved = garment.vertices + np.float32([0, 0.003, 0.004])
    assert np.allclose(errors(moved, garment.vertices, garment), 5.0, atol=1e-3)


def test_without_the_projection_one_sees_what_the_animator_made():
    frame = stage().frame
    assert cloth_of(frame, "finished") is frame.vertices
    assert cloth_of(frame, "before the projection") is frame.before_projection
    assert cloth_of(frame, "the animator's own") is frame.animated
    assert len(STAGES) == 3


def test_what_is_red_is_inside():
    frame = stage().frame
    held = inside_body(frame.animated, frame)
    assert np.array_equal(held, inside(frame.body.vertices, frame.body.faces, frame.animated))
    after = inside_body(frame.vertices, frame)
    after[frame.report.pinched] = False
    assert not after.any()
    found = measure_frame(0, frame, shirt().garment)
    assert found.inside == np.count_nonzero(inside_body(frame.before_projection, frame)) and found.stretch > 0


def test_the_worst_frames_come_first():
    rows = worst_frames([FrameMeasures(0, 3.0, 0), FrameMeasures(1, 41.0, 7), FrameMeasures(2, 8.0, 0)])
    assert [index for index, _ in rows] == [1, 2, 0, 1]
    assert rows[0][1] == "frame 1: an edge 41 % too long" and rows[-1][1] == "frame 1: 7 inside before the projection"


def test_what_is_downloaded_is_what_was_played():
    shown = stage()
    shown.go(2)
    shown.arrive()
    gathered = clip_of(shown)
    assert gathered.frame_count == 3 and np.array_equal(gathered.vertices[2], shown.frame.vertices)
    assert file_of(gathered, "glb")[:4] == b"glTF"


def test_a_shelf_lists_models_clips_and_takes(tmp_path):
    shown = catalog(tmp_path / "takes")
    assert shown.model_names == ("shirt", NO_MODEL)
    assert shown.clip_names == ("take: takes/walk", "walk", "turn")
    assert isinstance(shown.source(shown.first()), SimulatedClip)
    played = shown.source(Choice("shirt", "take: takes/walk"))
    assert isinstance(played, PlayedClip) and np.array_equal(played.truth(1), take().vertices[1])
    assert catalog().first() == Choice("shirt", "walk")
    assert not shown.takes_wind(shown.first())


REFUSED = {
    "model": (Choice("trousers", "walk"), "there is no model of that name; got 'trousers'; choose one of shirt"),
    "clip": (Choice("shirt", "swim"), "there is no clip of that name; got 'swim'; choose one of"),
    "no model": (Choice(NO_MODEL, "walk"), "a clip alone moves no garment; got 'walk'"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_not_on_the_shelf_is_refused(name, tmp_path):
    choice, said = REFUSED[name]
    with pytest.raises(BadInput, match=said):
        catalog(tmp_path / "takes").source(choice)


def test_a_take_of_another_garment_is_refused(tmp_path):
    from hemline import animators

    whole = catalog(tmp_path / "takes")
    other = Catalog({"cape": lambda: animators.load("cape")}, {"walk": clip}, whole.datasets)
    with pytest.raises(BadInput, match="model 'cape' wears another garment than this take"):
        other.source(Choice("cape", other.clip_names[0]))


def test_an_empty_shelf_is_refused():
    with pytest.raises(BadInput, match="there is nothing to play"):
        Catalog({}, {"walk": clip})


def test_of_many_requests_of_a_kind_only_the_last_counts():
    requests = Requests()
    requests.put(Request.FRAME, 1)
    requests.put(Request.PLAY_OR_PAUSE)
    requests.put(Request.FRAME, 2)
    assert list(requests.take().items()) == [(Request.PLAY_OR_PAUSE, None), (Request.FRAME, 2)]
    assert requests.take() == {}
