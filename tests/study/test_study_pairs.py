"""Clips are paired by name, and what cannot be compared is refused with a cure."""

import shutil

import pytest
from PIL import Image

from hemline.errors import BadInput, HemlineWarning
from hemline.study import pairs_of
from tests.study.study_samples import BLUE, RED, make_clip, make_folders


def test_two_files_are_a_pair(tmp_path):
    a, b = make_clip(tmp_path / "ours.webp", RED), make_clip(tmp_path / "skinned.webp", BLUE)
    (pair,) = pairs_of([a, b])
    assert (pair.name, pair.a, pair.b) == ("ours vs skinned", a, b)
    assert pairs_of([str(a), str(b)]) == (pair,)


def test_folders_are_paired_by_file_name(tmp_path):
    ours, skinned = make_folders(tmp_path)
    (ours / "notes.txt").write_text("no clip")
    pairs = pairs_of([ours, skinned])
    assert [pair.name for pair in pairs] == ["kick", "turn", "walk"]
    (ours / "._walk.webp").write_text("what a file manager left")
    assert pairs_of([ours, skinned]) == pairs
    assert all(pair.a == ours / f"{pair.name}.webp" and pair.b == skinned / f"{pair.name}.webp" for pair in pairs)
    more = make_clip(tmp_path / "jump-a.gif", RED), make_clip(tmp_path / "jump-b.gif", BLUE)
    assert [pair.name for pair in pairs_of([ours, skinned, *more])][-1] == "jump-a vs jump-b"


def test_a_clip_that_one_folder_lacks_is_said(tmp_path):
    ours, skinned = make_folders(tmp_path)
    (skinned / "turn.webp").unlink()
    with pytest.warns(HemlineWarning, match="only one folder has; got turn.webp"):
        assert [pair.name for pair in pairs_of([ours, skinned])] == ["kick", "walk"]


def test_the_hash_tells_clips_apart(tmp_path):
    a, b = make_clip(tmp_path / "a.webp", RED), make_clip(tmp_path / "b.webp", BLUE)
    both, turned = pairs_of([a, b])[0].contents, pairs_of([b, a])[0].contents
    shutil.copy(a, tmp_path / "c.webp")
    assert both != turned
    assert pairs_of([tmp_path / "c.webp", b])[0].contents == both
    make_clip(a, (220, 31, 30))
    assert pairs_of([a, b])[0].contents not in (both, turned)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    make_folders(tmp_path, ("walk",))
    make_clip(tmp_path / "short.webp", RED, frames=10)
    make_clip(tmp_path / "small.webp", RED, size=32)
    make_clip(tmp_path / "one.webp", RED)
    make_clip(tmp_path / "one.gif", RED)
    with Image.open(tmp_path / "one.webp") as picture:
        picture.save(tmp_path / "thrice.webp", save_all=True, loop=3, lossless=True)
    (tmp_path / "bad names" / "a").mkdir(parents=True)
    shutil.copy(tmp_path / "one.webp", tmp_path / "bad names" / "a" / "two\nlines.webp")
    Image.new("RGB", (64, 64)).save(tmp_path / "still.webp")
    (tmp_path / "cut.webp").write_bytes((tmp_path / "one.webp").read_bytes()[:300])
    (tmp_path / "gif.webp").write_bytes((tmp_path / "one.gif").read_bytes())
    (tmp_path / "empty.mp4").write_bytes(b"")
    (tmp_path / "text.webm").write_text("no video")
    (tmp_path / "a.glb").write_bytes(b"glTF")
    (tmp_path / "empty").mkdir()
    (tmp_path / "two\nlines.webp").write_bytes(b"")
    make_clip(tmp_path / "other" / "turn.webp", RED)
    make_clip(tmp_path / "sums" / "=1+1.webp", RED)
    make_clip(tmp_path / "-sums" / "walk.webp", RED)
    return tmp_path


CASES = {
    "nothing": ([], "got 0 paths; name A and B"),
    "one path": (["one.webp"], "clips are compared in twos; got 1 paths"),
    "missing": (["one.webp", "no.webp"], "cannot read no.webp; got No such file"),
    "a folder and a file": (["ours", "one.webp"], "two clips or two folders; got ours, a folder, with a file"),
    "no common names": (["ours", "other"], "have no clips of the same names; got walk.webp and turn.webp"),
    "no clips": (["ours", "empty"], "got walk.webp and no clips"),
    "no clip": (["a.glb", "a.glb"], "a.glb is no clip that a browser plays (.webp, .gif, .webm, .mp4); got '.glb'"),
    "two kinds": (["one.webp", "one.gif"], "must be of one kind; got .webp and .gif"),
    "two lengths": (["one.webp", "short.webp"], "must have the same length; got 1.000 s and 0.500 s"),
    "two sizes": (["one.webp", "small.webp"], "same size; got 64 x 64 pixels and 32 x 32 pixels"),
    "once and for ever": (["one.webp", "thrice.webp"], "must have the same number of repeats; got endless and 3"),
    "a still": (["one.webp", "still.webp"], "still.webp must move; got a single picture"),
    "a damaged clip": (["one.webp", "cut.webp"], "cut.webp is no WEBP that can be read; got 300 bytes"),
    "another ending": (["one.webp", "gif.webp"], "gif.webp is no WEBP that can be read"),
    "an empty video": (["empty.mp4", "empty.mp4"], "empty.mp4 is no .mp4 video; got 0 other bytes"),
    "text as a video": (["text.webm", "text.webm"], "text.webm is no .webm video"),
    "one name twice": (["ours", "skinned", "ours", "ours"], "two pairs have the name 'walk'"),
    "a name of two lines in a folder": (["bad names/a", "bad names/a"], "must be one line of text"),
    "a formula in a folder": (
        ["sums", "sums"],
        "the name of a clip would be a formula in a spreadsheet; got '=1+1.webp'",
    ),
    "a formula": (["sums/=1+1.webp", "one.webp"], "the name of a clip would be a formula in a spreadsheet"),
    "a path that is one": (["-sums", "ours"], "a path of a clip would be a formula in a spreadsheet; got '-sums'"),
    "a name of two lines": (["one.webp", "two\nlines.webp"], "must be one line of text"),
}


@pytest.mark.parametrize("name", CASES)
def test_what_cannot_be_compared_is_refused(name, folder):
    paths, said = CASES[name]
    with pytest.raises(BadInput) as refused:
        pairs_of(paths)
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_pair_reads_what_it_was_made_of_and_nothing_else(tmp_path):
    a, b = make_clip(tmp_path / "a.webp", RED), make_clip(tmp_path / "b.webp", BLUE)
    (pair,) = pairs_of([a, b])
    assert (pair.read("A"), pair.read("B")) == (a.read_bytes(), b.read_bytes())
    shutil.copy(b, a)
    for side in ("A", "B"):
        with pytest.raises(BadInput, match="the clips of the pair 'a vs b' have changed; got .*a.webp and .*b.webp"):
            pair.read(side)
    b.unlink()
    with pytest.raises(BadInput, match="cannot read .*b.webp; got No such file or directory"):
        pair.read("A")


def test_a_folder_that_cannot_be_read_is_said(tmp_path, monkeypatch):
    ours, skinned = make_folders(tmp_path, ("walk",))

    def closed(folder):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(type(ours), "iterdir", closed)
    with pytest.raises(BadInput, match="cannot read .*ours; got Permission denied; name a folder that can be read"):
        pairs_of([ours, skinned])
