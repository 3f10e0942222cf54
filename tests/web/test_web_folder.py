"""A page in a folder that holds other things, too: those stay, and the page is the old one or the new one."""

import json
import os
import re
import subprocess
import sys
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest

from hemline.cli import main
from hemline.errors import BadOutput
from hemline.files.waiting import release_lock, take_lock
from hemline.web.assemble import FolderPage
from hemline.web.contents import PageContents
from hemline.web.folder import write_page_folder
from hemline.web.write import check_page, write_page
from tests.files.killed import killed_at_each_step, limited

OTHERS = {
    "CNAME": "clothes.example",
    ".nojekyll": "",
    ".git/HEAD": "ref: refs/heads/gh-pages",
    "about/index.html": "<p>About us",
    "contents.bin": "mine",
    "js/main.js": "mine",
}
"""What somebody who publishes with GitHub Pages may have beside a page."""


def contents(number: float = 0.0) -> PageContents:
    return PageContents({"a": np.full(3, number)}, {"kind": "page"})


def write(folder: Path, title: str = "one", number: float = 0.0) -> tuple[Path, ...]:
    return write_page(folder, contents(number), title=title)


def add_others(folder: Path) -> None:
    for name, text in OTHERS.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)


def files(folder: Path) -> set[str]:
    return {str(each.relative_to(folder)) for each in folder.rglob("*") if each.is_symlink() or not each.is_dir()}


def hash_of(path: Path) -> str:
    return sha256(path.read_bytes()).hexdigest()


def whole_page(folder: Path) -> tuple[str, set[str]]:
    """Title of the page in a folder, which must be whole, and its files."""
    index = (folder / "index.html").read_text()
    places = set(re.findall(r"hemline-[0-9a-f]{12}", index))
    assert len(places) == 1
    place = places.pop()
    told = json.loads((folder / place / "page.json").read_text())
    assert told["index"] == hash_of(folder / "index.html")
    assert {name: hash_of(folder / place / name) for name in told["parts"]} == told["parts"]
    assert set(re.findall(rf'"\./{place}/([^"]*[^/"])"', index)) <= set(told["parts"])
    own = {"index.html", f"{place}/page.json", *(f"{place}/{name}" for name in told["parts"])}
    return re.findall("<title>(.*)</title>", index)[0], own


def others_are_there(folder: Path) -> bool:
    return {name: (folder / name).read_text() for name in OTHERS} == OTHERS


@pytest.mark.parametrize("named", ["from elsewhere", "as ."])
def test_a_page_is_replaced_and_what_else_lies_there_stays(tmp_path, monkeypatch, capsys, named):
    folder = tmp_path / "site"
    assert main(["page", "tshirt-light", "-m", "walk", "-o", str(folder), "--title", "one"]) == 0
    first = whole_page(folder)[1]
    add_others(folder)
    if named == "as .":
        monkeypatch.chdir(folder)
    assert main(["page", "tshirt-light", "-m", "walk", "-o", "." if named == "as ." else str(folder)]) == 0
    title, own = whole_page(folder)
    assert title == "tshirt-light" and files(folder) == own | set(OTHERS) and others_are_there(folder)
    assert first & own == {"index.html"} and os.listdir(tmp_path) == ["site"]


def test_a_page_is_added_to_a_folder_that_never_had_one(tmp_path):
    add_others(tmp_path)
    paths = write(tmp_path)
    title, own = whole_page(tmp_path)
    assert title == "one" and files(tmp_path) == own | set(OTHERS) and others_are_there(tmp_path)
    assert sorted(paths) == sorted(tmp_path / name for name in own)


def write_small(folder: Path, number: int) -> None:
    """A page of few parts, which is written in few steps."""
    place = f"hemline-{number:012x}"
    parts = {name: f"{name} {number}".encode() for name in ("contents.bin", "js/main.js", "three/LICENSE")}
    index = f'<title>{number}</title><script src="./{place}/js/main.js">'.encode()
    write_page_folder(folder, FolderPage(index, place, parts))


SMALL = """
import sys
import random
from pathlib import Path
from tests.web.test_web_folder import BadOutput, whole_page, write_small
"""


def test_killed_at_any_step_it_shows_the_old_page_or_the_new_one_and_the_next_run_tidies_up(tmp_path):
    work = f"{SMALL}\ndef work(): write_small(Path('.'), 1 + int(whole_page(Path('.'))[0]))"
    add_others(tmp_path)
    write_small(tmp_path, 0)
    before, grown, left = 0, [], set()
    for _ in killed_at_each_step(work, tmp_path, every=2):
        assert others_are_there(tmp_path)
        shown = int(whole_page(tmp_path)[0])
        grown.append(shown - before)
        before = shown
        left.add(len(os.listdir(tmp_path)))
    assert set(grown) == {0, 1} and grown[-1] == 1 and 3 < sum(grown) < len(grown) - 10
    assert len(left) > 1  # killed ones left things, which the last removed
    assert files(tmp_path) == whole_page(tmp_path)[1] | set(OTHERS)


def test_killed_before_there_was_a_page_it_shows_none_or_the_whole_and_the_next_run_completes_it(tmp_path):
    work = f"{SMALL}\ndef work(): write_small(Path('new/site'), random.randrange(3))"
    folder, shown = tmp_path / "new" / "site", []
    for _ in killed_at_each_step(work, tmp_path):
        shown.append((folder / "index.html").exists())
        if shown[-1]:
            whole_page(folder)
            (folder / "index.html").unlink()
    assert 1 < sum(shown) < len(shown) - 10
    write_small(folder, 7)
    title, own = whole_page(folder)
    assert title == "7" and files(folder) == own


def test_an_index_that_is_not_ours_is_kept_and_nothing_is_written(tmp_path):
    folder = tmp_path / "site"
    folder.mkdir()
    (folder / "index.html").write_text("<p>My own page")
    for attempt in (check_page, write):
        with pytest.raises(
            BadOutput, match=r"index.html is not as hemline wrote it; got a page of somebody else.*move"
        ):
            attempt(folder)
    assert files(folder) == {"index.html"} and (folder / "index.html").read_text() == "<p>My own page"


def test_an_index_that_somebody_changed_is_kept(tmp_path):
    write(tmp_path)
    index = tmp_path / "index.html"
    index.write_text(index.read_text().replace("</body>", "<p>Imprint</body>"))
    before = {name: hash_of(tmp_path / name) for name in files(tmp_path)}
    with pytest.raises(BadOutput, match="one that was changed"):
        write(tmp_path, "two")
    assert {name: hash_of(tmp_path / name) for name in files(tmp_path)} == before


def test_parts_that_somebody_changed_or_added_stay(tmp_path):
    write(tmp_path)
    place = next(tmp_path.glob("hemline-*"))
    (place / "js" / "main.js").write_text("changed")
    (place / "js" / "mine.js").write_text("mine")
    write(tmp_path, "two")
    own = whole_page(tmp_path)[1]
    assert files(tmp_path) - own == {f"{place.name}/{name}" for name in ("js/main.js", "js/mine.js", "page.json")}
    assert (place / "js" / "main.js").read_text() == "changed"


def test_a_list_from_a_stranger_removes_nothing_beyond_its_own_folder(tmp_path):
    folder, elsewhere = tmp_path / "site", tmp_path / "elsewhere"
    for each in (folder, elsewhere):
        each.mkdir()
        (each / "mine.txt").write_text("mine")
    digest = hash_of(elsewhere / "mine.txt")
    ways = ["../mine.txt", "../../elsewhere/mine.txt", str(elsewhere / "mine.txt"), "js/mine.txt", "mine.txt"]
    for number, way in enumerate(ways):
        place = folder / f"hemline-{number:012x}"
        place.mkdir()
        (place / "page.json").write_text(json.dumps({"kind": "hemline page", "index": "", "parts": {way: digest}}))
        (place / "js").symlink_to(elsewhere)
        (place / "mine.txt").symlink_to(elsewhere / "mine.txt")
    (folder / "hemline-00000000000a").symlink_to(elsewhere)
    (elsewhere / "js").mkdir()
    (elsewhere / "js" / "mine.txt").write_text("mine")
    told = {"kind": "hemline page", "index": "", "parts": {"js/mine.txt": digest}}
    (elsewhere / "page.json").write_text(json.dumps(told))
    for number, text in enumerate(["[" * 100_000, "7", '{"kind": "hemline page", "index": [], "parts": {}}', "{"]):
        place = folder / f"hemline-{number:011x}f"
        place.mkdir()
        (place / "page.json").write_text(text)
    before = files(folder) | {"../elsewhere/" + name for name in files(elsewhere)}
    write(folder)
    own = whole_page(folder)[1]
    assert files(folder) - own | {"../elsewhere/" + name for name in files(elsewhere)} == before


def test_links_that_lead_out_of_the_folder_are_not_followed(tmp_path):
    folder, elsewhere = tmp_path / "site", tmp_path / "elsewhere"
    elsewhere.mkdir()
    write(folder)
    place = next(folder.glob("hemline-*"))
    (folder / "index.html").replace(elsewhere / "index.html")
    (folder / "index.html").symlink_to(elsewhere / "index.html")
    with pytest.raises(BadOutput, match=r"index.html is not as hemline wrote it; got a link"):
        write(folder, "two")
    (folder / "index.html").unlink()
    (place / "js").rename(elsewhere / "js")
    (place / "js").symlink_to(elsewhere / "js")
    before = {name: hash_of(elsewhere / name) for name in files(elsewhere)}
    with pytest.raises(BadOutput, match=r"js is a link; got one to .*; remove it"):
        write(folder)  # the same page: its parts would come to lie there
    (place / "js").unlink()
    (place / "contents.bin").unlink()
    (place / "contents.bin").symlink_to(elsewhere / "index.html")
    with pytest.raises(BadOutput, match=r"contents.bin is a link"):
        write(folder)
    assert {name: hash_of(elsewhere / name) for name in files(elsewhere)} == before


def test_a_folder_that_is_named_by_a_link_is_written_and_stays_a_link(tmp_path):
    (tmp_path / "site").mkdir()
    (tmp_path / "link").symlink_to("site")
    assert write(tmp_path / "link")[-1] == tmp_path / "link" / "index.html"
    assert os.readlink(tmp_path / "link") == "site" and whole_page(tmp_path / "site")[0] == "one"


def test_root_and_home_are_refused(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    for path in (tmp_path, "/", "."):
        for attempt in (check_page, write):
            with pytest.raises(BadOutput, match="a page needs a folder of its own"):
                attempt(Path(path))
    assert files(tmp_path) == set()
    write(tmp_path / "site")


def test_while_a_page_is_written_another_hemline_is_refused(tmp_path):
    write(tmp_path)
    lock = take_lock(tmp_path)
    with pytest.raises(BadOutput, match="got another hemline, which writes a page there; wait"):
        write(tmp_path, "two")
    release_lock(lock)
    write(tmp_path, "two")
    assert whole_page(tmp_path)[0] == "two"


def test_two_that_write_at_once_leave_one_whole_page(tmp_path):
    program = f"""{SMALL}
for number in range(25):
    try:
        write_small(Path("."), 2 * number + int(sys.argv[1]))
    except BadOutput as error:
        assert "another hemline" in str(error), error
"""
    write_small(tmp_path, 0)
    both = [subprocess.Popen([sys.executable, "-c", program, name], cwd=tmp_path) for name in ("0", "1")]
    assert [each.wait(timeout=60) for each in both] == [0, 0]
    assert files(tmp_path) == whole_page(tmp_path)[1]


@pytest.mark.parametrize("out", ["old", "new/site", "page.html"])
def test_a_full_disk_is_one_line_and_nothing_is_lost_or_left(tmp_path, out):
    add_others(tmp_path / "old")
    write(tmp_path / "old")
    (tmp_path / "page.html").write_text("old")
    before = {name: hash_of(tmp_path / name) for name in files(tmp_path)}
    words = ["page", "tshirt-light", "-m", "walk", "-o", out]
    run = f"import sys\nfrom hemline.cli import main\nsys.stderr = sys.stdout\nassert main({words}) == 2"
    play = f"import hemline.cli, hemline.web\nhemline.web.check_page({out!r})"
    said = limited(run, tmp_path, before=play, most_bytes=200_000)
    _, error = said.splitlines()  # after the line that says what is being done
    assert error.startswith("hemline: cannot write ") and "File too large" in error
    assert {name: hash_of(tmp_path / name) for name in files(tmp_path)} == before
    assert sorted(os.listdir(tmp_path)) == ["old", "page.html"]
