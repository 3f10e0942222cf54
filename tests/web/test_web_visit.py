"""Somebody visits the page: from a file, from a web host, with a mouse, with a finger."""

import io
import threading
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer

import numpy as np
import pytest
from PIL import Image

import hemline
from hemline import bodies, web
from hemline.motions import load
from tests.web.web_pages import opened

MODELS = ("tshirt-light", "trousers-light")
TITLE = "</title><b>Shirts &amp; more {{boot}}"
TALLEST = "return hemline.body.vertices.reduce((most, y, i) => (i % 3 === 1 ? Math.max(most, y) : most), 0)"


@pytest.fixture(scope="module")
def contents():
    clips = {name: load(name)[:40] for name in ("walk", "kick")}
    return web.page_contents({name: hemline.load(name) for name in MODELS}, clips, bodies.load("anny24").shaped())


@pytest.fixture(scope="module")
def visited(contents, tmp_path_factory):
    path = tmp_path_factory.mktemp("visit") / "page.html"
    web.write_page(path, contents, title=TITLE)
    with opened(path.as_uri()) as page:
        yield page


def picture(page) -> np.ndarray:
    """What stands above the panel."""
    seen = Image.open(io.BytesIO(page.driver.get_screenshot_as_png())).convert("RGB")
    return np.asarray(seen)[60 : int(0.75 * seen.height)].astype(int)


def settled_picture(page) -> np.ndarray:
    """The same, once what was asked for has been drawn."""
    page.driver.execute_async_script("const done = arguments[0]; requestAnimationFrame(() => setTimeout(done, 100));")
    return picture(page)


def set_value(page, name: str, value: object, event: str) -> None:
    script = (
        "const [name, value, event] = arguments, at = document.getElementById(name);"
        "at.value = value; at.dispatchEvent(new Event(event, { bubbles: true }));"
    )
    page.driver.execute_script(script, name, value, event)


def test_it_shows_body_and_garment_and_says_whose_they_are(visited):
    seen = settled_picture(visited)
    red, green, blue = np.moveaxis(seen, -1, 0)
    assert ((red > 90) & (red > 2 * green) & (red > 2 * blue)).sum() > 2000  # the shirt
    assert visited.driver.title == TITLE
    elements = "return ['b', 'title'].map((each) => document.getElementsByTagName(each).length)"
    assert visited.driver.execute_script(elements) == [0, 1]
    notices = visited.driver.execute_script("return document.getElementById('notices').textContent")
    assert "CC0-1.0" in notices and "CMU" in notices
    said = [each["message"] for each in visited.driver.get_log("browser") if each["level"] == "SEVERE"]
    assert said == []


def test_play_pause_and_speed(visited):
    button = visited.driver.find_element("id", "play")
    set_value(visited, "speed", 0.25, "input")
    button.click()
    visited.until("hemline.seconds > 0.1")
    assert "ms a frame" in visited.driver.find_element("id", "milliseconds").text
    button.click()
    before = settled_picture(visited)
    assert np.array_equal(before, settled_picture(visited))
    assert button.text == "Play"
    set_value(visited, "speed", 1, "input")


def test_scrubbing_shows_another_frame(visited):
    set_value(visited, "time", 0.1, "input")
    before = settled_picture(visited)
    set_value(visited, "time", 0.9, "input")
    assert visited.driver.execute_script("return Math.abs(hemline.seconds - 0.9 * hemline.clip.seconds) < 1e-6")
    assert (np.abs(before - settled_picture(visited)).max(axis=2) > 40).sum() > 500


def test_from_its_end_a_clip_starts_again(visited):
    script = "hemline.seek(hemline.clip.seconds); hemline.advance(1 / 30); return hemline.seconds"
    assert visited.driver.execute_script(script) == 0


def test_garment_clip_and_shape_are_chosen(visited):
    set_value(visited, "clip", "kick", "change")
    set_value(visited, "garment", "trousers-light", "change")
    assert visited.driver.execute_script(
        "return [hemline.player.metadata.name, hemline.clip === hemline.clips[1]]"
    ) == [
        "trousers-light",
        True,
    ]
    before = visited.driver.execute_script(TALLEST)
    visited.driver.execute_script(
        "const slider = document.querySelector('#shape input');"
        "slider.value = 2; slider.dispatchEvent(new Event('input'));"
    )
    assert abs(visited.driver.execute_script(TALLEST) - before) > 0.05
    assert visited.driver.execute_script("return hemline.body.betas[0]") == 2


def test_a_finger_turns_the_camera(visited):
    before = settled_picture(visited)
    for kind, x in (("touchStart", 300), ("touchMove", 420), ("touchMove", 540), ("touchEnd", None)):
        points = [] if x is None else [{"x": x, "y": 200}]
        visited.driver.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
    assert (np.abs(before - settled_picture(visited)).max(axis=2) > 40).sum() > 500


def test_a_narrow_window_keeps_the_whole_body_in_sight(visited):
    size = {"width": 390, "height": 844, "deviceScaleFactor": 1, "mobile": True}
    visited.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    set_value(visited, "time", 0.2, "input")
    seen = settled_picture(visited)
    visited.driver.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
    body = np.flatnonzero((seen[..., 0] - seen[..., 2] > 18).sum(axis=0) > 3)
    assert body.min() > 0 and body.max() < seen.shape[1] - 1


def test_a_folder_plays_from_a_plain_web_host(contents, tmp_path):
    web.write_page(tmp_path / "page", contents, title="a folder")
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(_Quiet, directory=str(tmp_path / "page")))
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        with opened(f"http://127.0.0.1:{server.server_port}/", playing=True) as page:
            page.until("hemline.seconds > 0.2")
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


class _Quiet(SimpleHTTPRequestHandler):
    def log_message(self, format, *args):
        pass
