"""The page of the demo names what exists, and shows the figures of each garment."""

import re

import pytest

from hemline.web import write_demo_page

ROW = {"frame_ms": {"median": 3.14159}, "inside_percent": {"after": 0.0}, "vertices": 12690}


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    folder = tmp_path_factory.mktemp("demo")
    (folder / "cape.webp").write_bytes(b"picture")
    (folder / "cape.glb").write_bytes(bytes(2_600_000))
    figures = {"cape": ROW | {"stretch_percent": {"p99_mean": 9.44}}, "a<b": ROW | {"stretch_percent": {"p99_mean": 1}}}
    return write_demo_page(folder, figures)


def test_links_and_pictures_exist_and_lie_beside_it(page):
    named = re.findall(r"(?:href|src)='([^']+)'", page.read_text())
    assert set(named) == {"play.html", "cape.webp", "cape.glb"}
    assert all((page.parent / name).is_file() for name in named)
    assert "http" not in page.read_text()


def test_figures_are_those_that_were_measured(page):
    text = page.read_text()
    assert "<tr><td>cape</td><td>3.14</td><td>0</td><td>9.4</td><td>12690</td></tr>" in text
    assert "<td>a&lt;b</td>" in text
    assert "cape.glb</a>, 3 MB" in text
