"""The page in a real browser: it shows the garment, plays, stops, takes what hands ask for; and how it ends."""

import io
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from PIL import Image

from tests.view.view_samples import catalog, serving

viser = pytest.importorskip("viser", reason="viser is not installed: pip install 'hemline[view]'")
from hemline.access import HOST  # noqa: E402
from hemline.cli import main  # noqa: E402
from hemline.errors import BadInput, MissingExtra  # noqa: E402
from hemline.view import Page  # noqa: E402
from hemline.view.browser.requests import Request  # noqa: E402
from tests.study.browser import browsing  # noqa: E402

DEADLINE = 90.0


def until(what: Callable[[], object], why: str):
    """Wait for something to be true; its value."""
    ends = time.monotonic() + DEADLINE
    while not (found := what()):
        assert time.monotonic() < ends, why
        time.sleep(0.05)
    return found


class Seen:
    """The page as somebody sees it."""

    def __init__(self, driver):
        self.driver = driver

    def picture(self) -> np.ndarray:
        """What lies left of the panel, (height, width, 3)."""
        picture = Image.open(io.BytesIO(self.driver.get_screenshot_as_png())).convert("RGB")
        return np.asarray(picture)[:, : int(0.65 * picture.width)].astype(int)

    def red(self) -> np.ndarray:
        """Where the shirt is."""
        red, green, blue = np.moveaxis(self.picture(), -1, 0)
        return (red > 90) & (red > 2 * green) & (red > 2 * blue)

    def shirt(self) -> np.ndarray:
        """The same, once there is a shirt."""
        until(lambda: self.red().sum() > 2000, "no garment on the page")
        return self.red()

    def click(self, words: str) -> None:
        button = f"[...document.querySelectorAll('button')].find(each => each.innerText.trim() === '{words}')"
        until(lambda: self.driver.execute_script(f"return {button} !== undefined"), f"no button '{words}'")
        self.driver.execute_script(f"{button}.click()")


@pytest.fixture(scope="module")
def driver() -> Iterator:
    with browsing() as driver:
        driver.set_window_size(800, 500)
        yield driver


@pytest.fixture
def seen(driver) -> Iterator[Seen]:
    yield Seen(driver)
    driver.get("about:blank")


def test_play_moves_the_garment_pause_stops_it_and_a_browser_may_come_back(seen):
    with serving(Page(catalog(), playing=False)) as page:
        seen.driver.get(page.url)
        first = seen.shirt()
        seen.click("Play")
        until(lambda: page.playing and page.stage.index, "a click on Play plays")
        until(lambda: (seen.red() != first).sum() > 200, "the garment moves")
        seen.click("Pause")
        until(lambda: not page.playing, "a click on Pause pauses")
        index, frame = page.stage.index, page.stage.frame
        seen.driver.get("about:blank")
        until(lambda: page.throttle.clear, "a browser that left is not waited for")
        seen.driver.get(page.url)
        seen.shirt()
        assert page.stage.index == index and page.stage.frame is frame, "pausing keeps the frame"


@pytest.mark.slow
def test_a_browser_that_leaves_while_it_plays_stops_nothing(seen, capfd):
    with serving(Page(catalog())) as page:
        seen.driver.get(page.url)
        seen.shirt()
        seen.driver.get("about:blank")
        until(lambda: page.throttle.clear, "a browser that left is not waited for")
        index = page.stage.index
        until(lambda: page.stage.index != index, "it plays on")
    assert "Traceback" not in capfd.readouterr().err


@pytest.mark.slow
def test_what_hands_ask_for_is_seen(seen):
    """Controls are moved on the server's side of a browser's messages; what they change is looked at in the browser."""
    with serving(Page(catalog(), playing=False)) as page:
        seen.driver.get(page.url)
        thin = seen.shirt()
        betas = (2.5, *page.stage.source.body.betas[1:].tolist())
        page.requests.put(Request.BETAS, betas)
        until(lambda: (seen.red() != thin).sum() > 200, "a slider changes the body and the garment on it")
        assert page.stage.source.body.betas[0] == np.float32(2.5)
        page.requests.put(Request.PAINT, "stretch")
        until(lambda: seen.red().sum() < 0.5 * thin.sum(), "stretch has colours of its own")
        assert "below 5 %" in seen.driver.find_element("tag name", "body").text


def test_what_cannot_be_done_is_said_and_what_was_shown_stays(tmp_path):
    said = []
    with serving(Page(catalog(tmp_path / "takes"), playing=False, report=said.append)) as page:
        choice, source = page.choice, page.stage.source
        page.requests.put(Request.CLIP, "walk")
        until(lambda: page.error, "a clip without a model is refused")
        assert said == [page.error] and "a clip alone moves no garment" in page.error
        assert page.choice == choice and page.stage.source is source
        page.requests.put(Request.MODEL, "shirt")
        until(lambda: page.choice.model == "shirt", "the next wish is fulfilled")
        assert page.error == "" and page.stage.truth is not None


def test_the_body_is_dragged_by_the_handle_in_a_pause_and_put_back():
    with serving(Page(catalog(), playing=False)) as page:
        before, upright = page.stage.frame.body.joints[0].astype(np.float64), np.array([1.0, 0, 0, 0])
        page.requests.put(Request.GRAB, True)
        until(lambda: page.scene.grabbed, "the handle is held")
        page.requests.put(Request.DRAG, (before + [0.3, 0.0, 0.0], upright))
        until(lambda: page.stage.frame.body.joints[0][0] > before[0] + 0.29, "the body follows the hand")
        page.requests.put(Request.GRAB, False)
        page.requests.put(Request.RESET_DRAG)
        until(lambda: page.stage.shift.is_identity, "it is put back")
        assert page.stage.index == 0


def test_the_worst_frames_are_found_and_gone_to():
    with serving(Page(catalog(), playing=False)) as page:
        page.requests.put(Request.MEASURE)
        until(lambda: len(page.panel.worst.options) > 1, "a list of frames")
        worst = page.panel.worst.options[0]
        index = int(worst.split()[1].rstrip(":"))
        until(lambda: page.stage.index == index, "the worst one is shown")
        assert worst.endswith("% too long") and page.stage.stored_frames == range(page.stage.count)


@pytest.mark.parametrize("port, said", [(70000, "a port lies from 0 to 65535; got 70000"), (None, "got it is in use")])
def test_a_port_that_cannot_be_had_is_refused(port, said):
    with socket.socket() as other:
        other.bind((HOST, 0))
        other.listen()
        with pytest.raises(BadInput, match=said):
            Page(catalog(), port=other.getsockname()[1] if port is None else port)


def test_a_taken_port_is_one_line_and_status_two(capsys):
    with socket.socket() as other:
        other.bind((HOST, 0))
        other.listen()
        port = str(other.getsockname()[1])
        assert main(["view", "tshirt-light", "-m", "walk", "--port", port, "--no-browser"]) == 2
    out, err = capsys.readouterr()
    *_, error = err.splitlines()  # after the line that says what is being done
    assert out == "" and error.startswith("hemline: ")
    assert port in err and "in use" in err


def test_without_viser_the_cure_is_said(monkeypatch):
    monkeypatch.setitem(sys.modules, "viser", None)
    with pytest.raises(MissingExtra, match=r"needs viser; it is not installed; run: pip install 'hemline\[view\]'"):
        Page(catalog())


REFUSED = {
    "no such model": (["trousers"], "trousers"),
    "no such clip": (["tshirt-light", "-m", "swim"], "no motion of that name ships; got 'swim'"),
    "a folder without takes": (["folder"], "folder is no dataset; got no garment.safetensors in it"),
    "no port": (["tshirt-light", "--port", "99999"], "a port lies from 0 to 65535; got 99999"),
    "a port in words": (["tshirt-light", "--port", "x"], "--port must be a whole number; got x"),
    "too many betas": (["tshirt-light", "--betas", *["0"] * 17], "17"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_shown_is_one_line_and_status_two(name, tmp_path, monkeypatch, capsys):
    words, said = REFUSED[name]
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    assert main(["view", *words, "--no-browser"]) == 2
    out, err = capsys.readouterr()
    *_, error = err.splitlines()  # after the line that says what is being done
    assert out == "" and error.startswith("hemline: ") and said in error, err


def test_ctrl_c_ends_it_cleanly():
    words = ["view", "tshirt-light", "-m", "walk", "--port", "0", "--no-browser"]
    with subprocess.Popen(
        [sys.executable, "-m", "hemline", *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # what a shell started in the background does not hear of Ctrl-C, and hands that on
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    ) as process:
        try:
            assert process.stdout is not None
            assert re.fullmatch(r"http://127\.0\.0\.1:[0-9]+/[0-9a-f]{32}/\n", process.stdout.readline())
            process.send_signal(signal.SIGINT)
            out, err = process.communicate(timeout=DEADLINE)
        finally:
            process.kill()
    assert process.returncode == 0 and out == ""
    assert err.splitlines()[1:3] == ["Ctrl-C ends it", "ended"]
