"""The page of a shipped model plays in Firefox as in Python: another engine, another compiler of WebAssembly."""

import pytest
from firefox import firefox
from web_pages import Opened, farthest_mm, played

import hemline
from hemline import web

FRAMES = 60


@pytest.mark.slow
@pytest.mark.parametrize("name", ["cape", "tshirt-light"])
def test_firefox_plays_sixty_frames_as_in_python(tmp_path, name):
    clip, model = hemline.motions.load("dance")[:FRAMES], hemline.load(name)
    body = hemline.bodies.load("anny24").shaped()
    web.write_page(tmp_path / "page.html", web.page_contents({name: model}, {"clip": clip}, body), title=name)
    with firefox() as driver:
        driver.get((tmp_path / "page.html").as_uri())
        page = Opened(driver)
        page.until("window.hemline !== undefined && document.getElementById('loading').hidden")
        found, _, times = page.frames(0, FRAMES)
    assert len(found) == len(times) == FRAMES
    assert farthest_mm(found, played(model, body, clip, FRAMES)) < 1.0
