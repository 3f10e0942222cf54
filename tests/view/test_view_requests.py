"""Requests over the wire from somebody who sends anything: errors are reported, and the page plays on."""

import contextlib
import gc
import math
import threading

import numpy as np
import pytest
from PIL import Image

from hemline.errors import BadInput
from hemline.view import Catalog, Page
from hemline.view.browser import validate
from hemline.view.browser.page import LOOK_VALUES
from hemline.view.browser.requests import Request
from tests.view.view_samples import catalog, clip, serving, shirt
from tests.view.visitor import ConnectionClosed, Visitor, visiting

LABELS = ("Frame", "Speed", "Garment", "Motion", "Material", "Stage", "Colours", "Body", "Bones", "Colliders")
LABELS += ("Red: inside the body", "Camera follows", "Handle at the pelvis", "Shape 1", "Shape 16", "Go to")
LABELS += ("To its left, m/s",)
VALUES = ("0", "abc", "nope", "", "x" * 5000, "\x1b[2J", 0, -1, 1e9, -1e300, math.nan, math.inf, 2**63, None, True)
VALUES += ([], ["a"], {}, {"a": [1]}, b"\x00", [math.nan] * 3)


@pytest.fixture(scope="module")
def reports() -> list[str]:
    return []


@pytest.fixture(scope="module")
def page(reports):
    with serving(Page(catalog(), report=reports.append)) as page:
        yield page


@pytest.fixture
def visitor(page):
    with visiting(page.url) as visitor:
        visitor.until(lambda: visitor.control("Go to"), "the page's controls")
        yield visitor


def heard(page: Page, visitor: Visitor, control: str) -> None:
    """A good request is fulfilled, whatever was refused before it."""
    good = {"Speed": ("2", "1"), "Colours": ("stretch", "one colour")}[control]

    for value in good:
        visitor.set(control, value)
        visitor.until(lambda value=value: value in (f"{page.speed:g}", page.look.paint), f"{control} of {value}")


def plays(page: Page, visitor: Visitor) -> None:
    """It plays, or does when a hand asks for it."""
    if not page.playing:
        visitor.set("Play", True)
        visitor.until(lambda: page.playing, f"playing again after {page.error}")
    index = page.stage.index
    visitor.until(lambda: page.stage.index != index, "the next frame")


@pytest.mark.parametrize("label", LABELS)
def test_any_value_of_any_control_leaves_it_playing(page, visitor, reports, label, capfd, caplog):
    reports.clear()
    for value in VALUES:
        visitor.set(label, value)
    for control in ("Speed", "Colours"):
        heard(page, visitor, control)
    plays(page, visitor)
    assert page.choice.model == "shirt" and page.choice.clip == "walk"
    assert all(line.isprintable() and len(line) <= 600 for line in reports)
    gc.collect()  # when a task of asyncio that failed is reports
    assert "Traceback" not in capfd.readouterr().err and caplog.records == []


def test_a_choice_right_after_a_refused_one_is_never_lost(page, visitor):
    for number in range(60):
        good = ("0.5", "2")[number % 2]
        visitor.set("Speed", "nope")
        visitor.set("Speed", good)
        visitor.until(lambda good=good: f"{page.speed:g}" == good, f"speed {good} after a refused one, try {number}")
    visitor.set("Speed", "1")
    visitor.until(lambda: page.speed == 1, "the usual speed")


def test_a_refused_choice_is_not_put_back_over_a_newer_one(reports):
    """The model that is refused takes its time, as one that is loaded; the user has chosen another one meanwhile."""
    loading, go_on = threading.Event(), threading.Event()

    def broken():
        loading.set()
        assert go_on.wait(30)
        raise BadInput("this model is broken", "nothing", "choose another one")

    stock = Catalog({"shirt": shirt, "broken": broken, "other": shirt}, {"walk": clip})
    with serving(Page(stock, playing=False, report=reports.append)) as page, visiting(page.url) as visitor:
        visitor.set("Garment", "broken")
        visitor.until(loading.is_set, "the broken model is loaded")
        visitor.set("Garment", "other")
        visitor.until(lambda: page.requests.is_pending(Request.MODEL), "a newer request waits")
        heard_before = len(visitor.heard)
        go_on.set()
        visitor.until(lambda: page.choice.model == "other", "the newer choice")
        control = visitor.control("Garment")
        sent = [each for each in visitor.heard[heard_before:] if each.get("uuid") == control and "updates" in each]
        assert not any("value" in each["updates"] for each in sent), "its list is left alone"


def test_each_request_has_one_handler():
    assert set(Page.HANDLERS) | set(LOOK_VALUES) == set(Request)
    assert not set(Page.HANDLERS) & set(LOOK_VALUES)


REFUSED = {
    "Speed": ("0", "there is no such speed; got '0'; choose one of the list"),
    "Garment": ("trousers", "there is no such garment; got 'trousers'"),
    "Motion": ("nope", "there is no such motion; got 'nope'"),
    "Material": ("paper", "there is no such material; got 'paper'"),
    "Stage": ("nope", "there is no such choice for 'shown'; got 'nope'"),
    "Colours": ("nope", "there is no such choice for 'paint'; got 'nope'"),
    "Body": ("nope", "there is no such choice for 'body'; got 'nope'"),
    "Go to": ("x", "there is no such frame; got 'x'"),
    "Frame": (10**6, "the number of a frame lies from 0 to 19; got 1000000"),
    "Shape 1": (1e6, "the shape of a body lies from -3 to 3; got 1000000.0"),
}


@pytest.mark.parametrize("label", REFUSED)
def test_what_is_refused_is_said_and_the_control_is_put_back(page, visitor, reports, label):
    value, said = REFUSED[label]
    playing = page.playing
    reports.clear()
    visitor.set(label, value)
    visitor.until(lambda: reports, "a line in the terminal")
    assert reports[0].startswith(said) and page.playing == playing
    visitor.until(lambda: any("color:#c92a2a" in each for each in visitor.html()), "line on the page")
    control = visitor.control(label)

    def held() -> bool:
        sent = [each for each in visitor.heard if each.get("uuid") == control and "updates" in each]
        return bool(sent) and sent[-1]["updates"].get("value") not in (None, value)

    visitor.until(held, "the control put back")
    plays(page, visitor)


DRAGS = {
    "nowhere": ([math.nan] * 3, [1, 0, 0, 0]),
    "far away": ([1e9, 0, 0], [1, 0, 0, 0]),
    "no turn": ([0, 1, 0], [0, 0, 0, 0]),
    "an endless turn": ([0, 1, 0], [math.inf, 0, 0, 0]),
    "two numbers": ([0, 1], [1, 0]),
    "words": (["a", "b", "c"], ["d"] * 4),
    "nothing": ([], []),
}


@pytest.mark.filterwarnings("ignore:.viser.")
@pytest.mark.parametrize("name", DRAGS)
def test_the_body_is_not_dragged_out_of_the_world(page, visitor, reports, name):
    position, wxyz = DRAGS[name]
    reports.clear()
    handle = {"name": "/world/handle", "owner": ""}
    visitor.send({"type": "TransformControlsDragStartMessage", **handle})
    visitor.until(lambda: page.scene.grabbed, "hand on the handle")
    visitor.send({"type": "TransformControlsUpdateMessage", **handle, "position": position, "wxyz": wxyz})
    with visiting(page.url) as again:
        with contextlib.suppress(ConnectionClosed):  # what is no place at all has ended that connection
            visitor.set("Speed", "0.1")
        visitor.until(lambda: reports, "a line in the terminal")
        again.send({"type": "TransformControlsDragEndMessage", **handle})
        again.until(lambda: not page.scene.grabbed, "hand off the handle")
        heard(page, again, "Speed")
        plays(page, again)
    assert np.isfinite(page.stage.frame.vertices).all() and page.stage.shift.is_identity


def test_a_picture_of_this_machine_is_read_by_nobody(tmp_path, reports):
    """viser's Markdown reads the files that a text names; ours is no Markdown."""
    private = tmp_path / "private.png"
    Image.new("RGB", (8, 8), (1, 2, 3)).save(private)
    name = f"![x]({private})"
    stock = Catalog({"shirt": shirt, name: shirt}, {"walk": clip, name: clip})
    with (
        serving(Page(stock, report=reports.append)) as page,
        visiting(page.url) as visitor,
        visiting(page.url) as other,
    ):
        for label in ("Garment", "Motion", "Material", "Speed", "Colours", "Go to"):
            visitor.set(label, f"{name}!")
        visitor.set("Garment", name)
        other.until(lambda: page.choice.model == name, "a garment of that name")
        other.until(lambda: any(f"<b>{name}" in each for each in other.html()), "its name as it is")
        for each in (visitor, other):
            assert not any(message["type"] == "GuiMarkdownMessage" for message in each.heard)
            assert b"data:image" not in each.raw and b"iVBORw0KGgo" not in each.raw


def test_names_and_errors_are_text(reports):
    evil = '{alert(document.domain)}<img src=x onerror="alert(1)">'
    with (
        serving(Page(Catalog({evil: shirt}, {"walk": clip}), report=reports.append)) as page,
        visiting(page.url) as visitor,
    ):
        visitor.set("Garment", evil + "!")
        visitor.until(lambda: any("alert(document.domain)}&lt;img" in each for each in visitor.html()), "the name")
        visitor.until(lambda: page.error, "what was refused")
        visitor.until(lambda: any("role=" in each for each in visitor.html()), "the refusal")
        assert not any("<img" in each for each in visitor.html())


def test_a_frame_that_fails_is_said_and_the_next_request_is_handled(monkeypatch):
    said: list[str] = []
    with serving(Page(catalog(), playing=False, report=said.append)) as page, visiting(page.url) as visitor:
        monkeypatch.setattr(page.stage, "move", lambda: 1 / 0)
        visitor.set("Play", True)
        visitor.until(lambda: said, "a line in the terminal")
        assert said[0] == "something failed; got ZeroDivisionError: division by zero" and not page.playing
        monkeypatch.undo()
        monkeypatch.setattr(page.scene, "draw", lambda *given: [][0])
        visitor.set("Stage", "before the projection")
        visitor.until(lambda: len(said) > 1, "a line in the terminal")
        assert said[1] == "something failed; got IndexError: list index out of range"
        monkeypatch.undo()
        plays(page, visitor)


@pytest.mark.parametrize(
    "check",
    [
        lambda: validate.check_choice("speed", 1, ("1",)),
        lambda: validate.check_choice("speed", ["1"], ("1",)),
        lambda: validate.check_switch("bones", 1),
        lambda: validate.check_number("wind", True, (0, 1)),
        lambda: validate.check_number("wind", math.nan, (0, 1)),
        lambda: validate.check_numbers("wind", "ab", 2, (0, 1)),
        lambda: validate.check_numbers("wind", (1.0,), 2, (0, 1)),
        lambda: validate.check_place(None),
        lambda: validate.check_place((np.zeros(3), np.ones(4))),
        lambda: validate.check_place((np.zeros(3), np.array([1.0, 0, 0, 0]), 3)),
    ],
)
def test_what_is_no_request_is_refused(check):
    with pytest.raises(BadInput):
        check()
