"""The pages of the repository make a site: no link, picture or page is lost on the way."""

import os
import re
import subprocess
import sys
from importlib.util import find_spec

import pytest

import hemline
from hemline import garments
from tests.promises.pages import PAGES, ROOT

pytestmark = pytest.mark.skipif(find_spec("mkdocs") is None, reason="mkdocs is not installed (extra 'docs')")


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The folder of the built site."""
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--quiet", "--strict", "--site-dir", str(folder)]
    environment = os.environ | {"NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


def test_each_page_is_a_page_of_the_site(site):
    for page in PAGES:
        path = page.relative_to(ROOT).with_suffix(".html")
        built = site / (path.with_name("index.html") if page.name == "README.md" else path)
        head = re.search(r"^# (.+)$", page.read_text(), re.MULTILINE)[1]
        text = built.read_text()
        assert "<p>```" not in text, f"{page.name}: a fenced block that the site does not know"
        assert head.replace("`", "").replace("'", "&#39;")[:12] in text, built


def test_pictures_move_on_the_gallery(site):
    shown = re.findall(r'<img[^>]* src="([^"]+)"', (site / "docs" / "gallery.html").read_text())
    moving = [name for name in shown if name.endswith(".webp")]
    assert len(moving) > 8 and all((site / "docs" / name).exists() for name in moving)


def test_what_is_public_is_described(site):
    described = (site / "api" / "garments.html").read_text()
    headings = re.split(r"<h2 id=", described)[1:]
    shown = {heading.split('"')[1]: re.sub(r"<[^>]+>", " ", heading) for heading in headings}
    for name in garments.__all__:
        assert len(shown[name.lower()].split()) > 4, f"{name} has a heading and nothing below it"
    front = (site / "api" / "hemline.html").read_text()
    for name in ("Player", "play", "evaluate"):
        assert f"hemline.{name}" in front and name in hemline.__all__


def test_paper_maps_are_there(site):
    for name in ("ropes", "agentdress", "swingar"):
        assert "<table>" in (site / "src" / "hemline" / "animators" / name / "index.html").read_text()
