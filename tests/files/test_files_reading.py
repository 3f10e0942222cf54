"""Files are read whole, and only where they are files of a size that can be."""

import os
import threading

import pytest

from hemline.errors import BadMesh
from hemline.files import read_bytes, read_text
from hemline.files.beside import beside

MOST = 100


def read(path):
    return read_bytes(path, MOST, error=BadMesh, cure="name a file")


def text(path, *, strict=True):
    return read_text(path, MOST, error=BadMesh, cure="name a file", encoding="utf-8", strict=strict)


@pytest.mark.parametrize("size", [0, 1, MOST])
def test_what_is_no_larger_than_allowed_is_read_whole(size, tmp_path):
    content = os.urandom(size)
    (tmp_path / "a").write_bytes(content)
    assert read(tmp_path / "a") == content == read(str(tmp_path / "a"))


def test_what_is_larger_is_refused(tmp_path):
    (tmp_path / "a").write_bytes(bytes(MOST + 1))
    with pytest.raises(BadMesh, match="a is too large; got 101 bytes; name a file of at most 100 bytes"):
        read(tmp_path / "a")


def test_a_file_whose_size_is_not_told_is_still_held_below_it():
    """Files of /proc have the size 0, and any content."""
    if not os.path.exists("/proc/self/maps"):
        pytest.skip("no /proc here")
    assert len(read("/proc/self/maps")) <= MOST


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes and devices as POSIX has them")
def test_other_things_are_named_and_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "link").symlink_to("pipe")
    for path, sort in ((tmp_path / "pipe", "a pipe"), (tmp_path / "link", "a pipe"), ("/dev/null", "a device")):
        with pytest.raises(BadMesh, match=f"cannot read {path}; got {sort}; name a file"):
            read(path)
    with pytest.raises(BadMesh, match=f"cannot read {tmp_path}; got a folder"):
        read(tmp_path)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes as POSIX has them")
def test_a_pipe_that_takes_a_files_place_in_between_is_not_waited_for(tmp_path, monkeypatch):
    os.mkfifo(tmp_path / "a")
    (tmp_path / "b").write_bytes(b"b")
    path = type(tmp_path)
    stat = path.stat
    monkeypatch.setattr(path, "stat", lambda self, **more: stat(tmp_path / "b" if self.name == "a" else self, **more))
    found = []

    def attempt():
        try:
            read(tmp_path / "a")
        except BadMesh as error:
            found.append(str(error))

    thread = threading.Thread(target=attempt, daemon=True)
    thread.start()
    thread.join(10)
    assert found and "got a pipe" in found[0]


@pytest.mark.parametrize("name", ["a\0b", "\ud800"])
def test_names_that_no_file_can_have(name, tmp_path):
    with pytest.raises(BadMesh, match="got a name that no file can have"):
        read(tmp_path / name)


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root reads all files")
def test_what_may_not_be_read_is_said(tmp_path):
    (tmp_path / "a").write_bytes(b"a")
    (tmp_path / "a").chmod(0)
    with pytest.raises(BadMesh, match="got Permission denied"):
        read(tmp_path / "a")


def test_lines_of_a_text_end_in_one_way(tmp_path):
    (tmp_path / "a").write_bytes(b"a\r\nb\rc\n\xc3\xa4")
    assert text(tmp_path / "a") == "a\nb\nc\nä"


def test_bytes_that_are_no_text(tmp_path):
    (tmp_path / "a").write_bytes(b"a\xff")
    assert text(tmp_path / "a", strict=False) == "a\ufffd"
    with pytest.raises(UnicodeDecodeError):
        text(tmp_path / "a")


def named(path, name):
    return beside(path, name, "a mesh", error=BadMesh, cure="move it")


def test_what_lies_beside_a_file_or_below_its_folder_is_found(tmp_path):
    (tmp_path / "below").mkdir()
    (tmp_path / "own").symlink_to("below")
    for name in ("a.obj", "below/a.obj", "./a.obj", "own/a.obj", "no such folder/a.obj", "a b.obj"):
        assert named(tmp_path / "it.toml", name) == tmp_path / name


@pytest.mark.parametrize(
    "name",
    [
        "/etc/passwd",
        "../a.obj",
        "below/../../a.obj",
        "..\\a.obj",
        "C:a.obj",
        "C:\\a.obj",
        "\\\\host\\a.obj",
        "a:b",
        "a\0b",
    ],
)
def test_what_leads_out_of_the_folder_is_refused(name, tmp_path):
    with pytest.raises(BadMesh, match="it.toml names a mesh that is not beside it; got '.*'; move it"):
        named(tmp_path / "it.toml", name)


def test_links_that_lead_out_of_the_folder_are_refused(tmp_path):
    inner = tmp_path / "inner"
    inner.mkdir()
    (tmp_path / "secret.obj").write_text("v 1 2 SECRET")
    (inner / "a.obj").symlink_to("../secret.obj")
    (inner / "up").symlink_to("..")
    for name in ("a.obj", "up/secret.obj"):
        with pytest.raises(BadMesh, match="names a mesh that is not beside it"):
            named(inner / "it.toml", name)


def test_a_circle_of_links_leads_nowhere(tmp_path):
    """Python 3.13 follows it no further, and then it cannot be read; those before it refuse it at once."""
    (tmp_path / "round").symlink_to("round")
    with pytest.raises(BadMesh, match="names a mesh that is not beside it|cannot read"):
        read(named(tmp_path / "it.toml", "round/a.obj"))


def test_a_link_to_the_folder_itself_is_no_way_out(tmp_path):
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to("real")
    assert named(tmp_path / "link" / "it.toml", "a.obj") == tmp_path / "link" / "a.obj"
