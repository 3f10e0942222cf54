"""What a page holds, what is refused, and that it is written whole or not at all."""

import gzip
import json
import os
import re
import shutil
import subprocess
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

import hemline
from hemline.cli import main
from hemline.errors import BadInput, BadModel, BadOutput
from hemline.files.tensors import tensor_bytes
from hemline.web import build, page_contents, parts, write_page
from tests.contract.made_models import agentdress_model, body, rigged_model, ropes_model, walk
from tests.export.web import packages

PAGE = build.PAGE


def made(models=None, clips=None):
    models = {"cape": ropes_model()} if models is None else models
    return page_contents(models, {"walk": walk()} if clips is None else clips, body())


def test_differences_lose_no_digit():
    digits = np.random.default_rng(0).integers(-127, 128, (30, 4)).astype(np.int8)
    back = np.cumsum(parts.differences(digits).astype(np.int64), axis=2).astype(np.int8)
    assert np.array_equal(back.transpose(2, 1, 0).reshape(30, 4), digits)


def test_what_only_fit_and_simulator_need_is_left_out_and_the_rest_is_as_in_the_model():
    held, model = made().arrays, ropes_model()
    assert not [name for name in held if "rest_edges" in name or "pin" in name or "corners" in name]
    assert np.array_equal(held["models.0.skinning.weight0"], model.skinning.arrays()["weight0"])
    assert np.array_equal(held["models.0.ropes.lengths"], model.ropes.lengths)
    assert not [name for name in held if "shapedirs" in name]
    assert "body.shapedirs" in made({"shirt": agentdress_model()}).arrays


def test_a_page_with_the_shipped_cape_is_of_twelve_megabytes_at_most(tmp_path):
    assert main(["page", "cape", "-m", "walk", "dance", "-o", str(tmp_path / "page.html"), "--most-mb", "12"]) == 0
    assert (tmp_path / "page.html").stat().st_size <= 12e6


def test_the_same_page_has_the_same_bytes(tmp_path):
    for name in ("one.html", "two.html"):
        write_page(tmp_path / name, made(), title="cape")
    assert (tmp_path / "one.html").read_bytes() == (tmp_path / "two.html").read_bytes()


def test_a_page_fetches_nothing_from_elsewhere(tmp_path):
    write_page(tmp_path / "page.html", made(), title="cape")
    text = (tmp_path / "page.html").read_text()
    assert not re.findall(r"(?:src|href)=\"(?!data:)", text)


@pytest.mark.parametrize("name", [each.name for each in (PAGE / "js").iterdir()])
def test_modules_import_what_is_there(name):
    for wanted in re.findall(r'from "([^"]+)"', (PAGE / "js" / name).read_text()):
        known = {"three", "three/OrbitControls.js"}
        assert wanted in known or (PAGE / "js" / wanted.removeprefix("hemline/")).is_file()


@pytest.mark.parametrize("name", ["live", "lag", "skinned", "swingar"])
def test_other_animators_are_refused_with_the_way_out(name):
    with pytest.raises(BadInput, match=f"kind '{name}'.*hemline animate .*glb"):
        made({"x": hemline.load(name)})


def test_rigging_is_refused():
    with pytest.raises(BadInput, match="--pose-model kernel"):
        made({"x": rigged_model()})


def test_a_page_needs_a_model_and_a_clip():
    with pytest.raises(BadInput, match="at least one model"):
        made({})
    with pytest.raises(BadInput, match="at least one clip"):
        made(clips={})


def test_another_body_is_refused():
    other = replace(body().body, template=1.01 * body().body.template)
    for model in (ropes_model(), agentdress_model()):
        with pytest.raises((BadInput, BadModel), match="fitted on body"):
            page_contents({"x": model}, {"walk": walk()}, other.shaped())


def test_a_page_larger_than_asked_is_one_line_and_nothing_written(tmp_path, capsys):
    words = ["page", "tshirt-light", "-m", "walk", "--most-mb", "2"]
    for name in ("page.html", "page"):
        assert main([*words, "-o", str(tmp_path / name)]) == 2
        _, said = capsys.readouterr().err.splitlines()
        assert "2 MB at most" in said and "--most-mb" in said
    assert list(tmp_path.iterdir()) == []


def test_a_model_that_no_page_plays_is_one_line(tmp_path, capsys):
    assert main(["page", "live", "-o", str(tmp_path / "page.html")]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 2, "what is being done, and the error"
    assert list(tmp_path.iterdir()) == []


def test_paths_that_hold_no_page_are_refused(tmp_path):
    with pytest.raises(BadOutput, match="end in .html"):
        write_page(tmp_path / "page.txt", made(), title="")
    with pytest.raises(BadOutput, match="cannot write"):
        write_page(tmp_path / "none" / "page.html", made(), title="")
    (tmp_path / "mine").write_text("mine")
    with pytest.raises(BadOutput, match="which is a file"):
        write_page(tmp_path / "mine", made(), title="")
    assert [each.name for each in tmp_path.rglob("*")] == ["mine"]


def test_export_and_animate_name_the_verb_that_writes_pages(tmp_path, capsys):
    assert main(["animate", "cape", "-m", "walk", "-o", str(tmp_path / "page.html")]) == 2
    assert "hemline page" in capsys.readouterr().err


def test_a_folder_holds_what_the_page_plays(tmp_path):
    paths = write_page(tmp_path / "page", made(), title="cape")
    assert sorted(paths) == sorted(each for each in (tmp_path / "page").rglob("*") if each.is_file())
    content = made()
    held = next((tmp_path / "page").glob("*/contents.bin"))
    assert gzip.decompress(held.read_bytes()) == tensor_bytes(content.arrays, content.metadata)


class Markup(HTMLParser):
    """What a reader of HTML finds: the title, and the names of all elements."""

    def __init__(self, text: str):
        super().__init__()
        self.title, self.within, self.elements = "", False, []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.elements.append(tag)
        self.within |= tag == "title"

    def handle_endtag(self, tag):
        self.within &= tag != "title"

    def handle_data(self, data):
        self.title += data if self.within else ""


TITLES = [
    "</title><b>bold",
    "<script>alert(1)</script>",
    "Fish &amp; chips",
    "{{boot}}",
    "{{title}} {{style}}",
    "{{x}}",
    r"\1",
]


@pytest.mark.parametrize("title", TITLES)
@pytest.mark.parametrize("name", ["page.html", "page"])
def test_a_title_is_text_whatever_it_says(tmp_path, name, title):
    (tmp_path / "plain").mkdir()
    index, plain = (
        write_page(tmp_path / name, made(), title=title)[-1],
        write_page(tmp_path / "p.html", made(), title=""),
    )
    if name == "page":
        plain = write_page(tmp_path / "plain", made(), title="")
    found, expected = Markup(index.read_text()), Markup(plain[-1].read_text())
    assert found.title == title and found.elements == expected.elements
    assert index.stat().st_size < plain[-1].stat().st_size + 200


def test_a_title_of_bytes_that_are_no_text_is_written(tmp_path):
    write_page(tmp_path / "page.html", made(), title=os.fsdecode(b"T-shirt \xff"))
    assert Markup((tmp_path / "page.html").read_text()).title == "T-shirt ?"


def test_the_verb_says_what_it_wrote(tmp_path, capsys):
    assert main(["page", "tshirt-light", "--clips", "walk", "-o", str(tmp_path / "p"), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["bytes"] == sum(Path(each).stat().st_size for each in told["files"])
    assert main(["page", "tshirt-light", "-m", "walk", "-o", str(tmp_path / "p")]) == 0
    assert capsys.readouterr().out.strip() == str(tmp_path / "p" / "index.html")


def test_kernels_are_those_of_their_source(tmp_path):
    if shutil.which("node") is None:
        pytest.skip("node is not installed (Debian: apt install nodejs npm)")
    build.build(packages(), tmp_path / "kernels.wasm")
    assert (tmp_path / "kernels.wasm").read_bytes() == (PAGE / "kernels.wasm").read_bytes()


def test_scripts_are_whole():
    if shutil.which("node") is None:
        pytest.skip("node is not installed (Debian: apt install nodejs npm)")
    for script in sorted((PAGE / "js").iterdir()):
        command = ["node", "--input-type=module", "--check"]
        subprocess.run(command, input=script.read_text(), text=True, check=True, timeout=60)
