"""Files are whole or not there at all: killed writers, full disks, links, pipes and devices, two writers at once."""

import os
import signal
import socket
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from hemline.errors import BadOutput
from hemline.files import atomic_write, atomic_writes, check_folder, check_writable, waiting
from tests.files.killed import killed_at_each_step, limited

OLD, NEW = b"old " * 5000, b"new " * 7000


def names(folder: Path) -> list[str]:
    return sorted(os.listdir(folder))


def test_a_writer_killed_at_any_step_leaves_the_old_or_the_new_file_and_the_next_one_tidies_up(tmp_path):
    work = f"""
from hemline.files import atomic_write
def work():
    with atomic_write("file.bin") as temporary, temporary.open("wb") as stream:
        stream.write({NEW!r}[:9000])
        stream.flush()
        open("/dev/null").close()  # a step in the midst of writing
        stream.write({NEW!r}[9000:])
"""
    path, found, left = tmp_path / "file.bin", set(), 0
    path.write_bytes(OLD)
    for _ in killed_at_each_step(work, tmp_path):
        found.add(path.read_bytes())
        left = max(left, len(names(tmp_path)) - 1)
        if path.read_bytes() == NEW:
            path.write_bytes(OLD)
    assert found == {OLD, NEW}
    assert left == 1  # what one killed writer left, the next removed
    assert names(tmp_path) == ["file.bin"]


def test_a_writer_killed_before_there_was_a_file_leaves_none_or_the_whole(tmp_path):
    work = f"""
from hemline.files import atomic_write
def work():
    with atomic_write("file.bin") as temporary:
        temporary.write_bytes({NEW!r})
"""
    path = tmp_path / "file.bin"
    for _ in killed_at_each_step(work, tmp_path):
        assert not path.exists() or path.read_bytes() == NEW
        path.unlink(missing_ok=True)


WAITING = """
import sys
from hemline.files import atomic_write
with atomic_write("file.bin") as temporary:
    temporary.write_bytes(b"mine")
    print("writing", flush=True)
    sys.stdin.readline()
"""


def writer(folder: Path) -> subprocess.Popen:
    """A process in the midst of writing `file.bin`, until it is sent a line."""
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    process = subprocess.Popen([sys.executable, "-c", WAITING], cwd=folder, text=True, **pipes)
    assert process.stdout.readline() == "writing\n"
    return process


def test_what_a_living_writer_holds_stays_and_what_a_killed_one_left_goes(tmp_path):
    living, killed = writer(tmp_path), writer(tmp_path)
    assert len(names(tmp_path)) == 2
    killed.send_signal(signal.SIGKILL)
    killed.communicate()
    with atomic_write(tmp_path / "file.bin") as temporary:
        temporary.write_bytes(b"ours")
    assert len(names(tmp_path)) == 2 and (tmp_path / "file.bin").read_bytes() == b"ours"
    living.communicate("go on\n")
    assert living.returncode == 0
    assert names(tmp_path) == ["file.bin"] and (tmp_path / "file.bin").read_bytes() == b"mine"


def test_without_locks_files_are_written_and_nothing_is_taken_for_abandoned(tmp_path, monkeypatch):
    killed = writer(tmp_path)
    killed.kill()
    killed.communicate()
    left = names(tmp_path)
    monkeypatch.setattr(waiting, "fcntl", None)
    with atomic_write(tmp_path / "file.bin") as temporary:
        temporary.write_bytes(NEW)
    assert names(tmp_path) == sorted([*left, "file.bin"])


def test_what_another_machine_or_somebody_else_left_stays(tmp_path):
    (tmp_path / ".hemline-writing-00000000-12345678").mkdir()
    (tmp_path / "mine").mkdir()
    (tmp_path / (waiting.PREFIX + "link")).symlink_to("mine")
    before = names(tmp_path)
    with atomic_write(tmp_path / "file.bin") as temporary:
        temporary.write_bytes(NEW)
    assert names(tmp_path) == sorted([*before, "file.bin"])


def test_a_failure_within_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "file.bin"
    path.write_bytes(OLD)
    with pytest.raises(KeyboardInterrupt), atomic_write(path) as temporary:
        temporary.write_bytes(NEW)
        raise KeyboardInterrupt
    with pytest.raises(BadOutput, match="cannot write .*file.bin; got No such file"), atomic_write(path):
        pass  # nothing was written, so there is nothing to put in its place
    assert names(tmp_path) == ["file.bin"] and path.read_bytes() == OLD


def test_a_full_disk_is_one_line_and_keeps_the_old_file(tmp_path):
    (tmp_path / "file.bin").write_bytes(OLD)
    program = """
from hemline.errors import BadOutput
from hemline.files import atomic_write
try:
    with atomic_write("file.bin") as temporary:
        temporary.write_bytes(bytes(9000))
except BadOutput as error:
    print(error)
"""
    said = limited(program, tmp_path, most_bytes=5000)
    assert said.startswith("cannot write file.bin; got File too large; name a folder") and said.count("\n") == 1
    assert names(tmp_path) == ["file.bin"] and (tmp_path / "file.bin").read_bytes() == OLD


def test_bytes_are_on_the_disk_before_a_name_leads_to_them_and_the_name_after(tmp_path, monkeypatch):
    path, seen, real = tmp_path / "file.bin", [], os.fsync
    path.write_bytes(OLD)

    def fsync(descriptor):
        status = os.fstat(descriptor)
        seen.append((status.st_ino, path.read_bytes()))
        real(descriptor)

    monkeypatch.setattr(os, "fsync", fsync)
    with atomic_write(path) as temporary:
        temporary.write_bytes(NEW)
    assert seen == [(path.stat().st_ino, OLD), (tmp_path.stat().st_ino, NEW)]


@pytest.mark.parametrize("mask", [0o022, 0o027, 0o077])
def test_a_new_file_has_the_mode_that_the_umask_asks_for_which_nobody_changes(tmp_path, monkeypatch, mask):
    before = os.umask(mask)
    try:
        with monkeypatch.context() as patched:
            patched.setattr(os, "umask", lambda _: pytest.fail("other threads make files meanwhile"))
            with atomic_write(tmp_path / "file.bin") as temporary:
                temporary.write_bytes(NEW)
                assert stat.S_IMODE(temporary.parent.stat().st_mode) == 0o700
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "file.bin").stat().st_mode) == 0o666 & ~mask


@pytest.mark.parametrize("mode", [0o600, 0o664, 0o444])
def test_a_file_that_is_replaced_hands_on_its_mode(tmp_path, mode):
    path = tmp_path / "file.bin"
    path.write_bytes(OLD)
    path.chmod(mode)
    with atomic_write(path) as temporary:
        temporary.write_bytes(NEW)
    assert stat.S_IMODE(path.stat().st_mode) == mode and path.read_bytes() == NEW


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root gives files to others")
def test_a_file_of_another_owner_stays_theirs(tmp_path):
    path = tmp_path / "file.bin"
    path.write_bytes(OLD)
    os.chown(path, 1234, 4321)
    path.chmod(0o600)
    with atomic_write(path) as temporary:
        temporary.write_bytes(NEW)
    status = path.stat()
    assert (status.st_uid, status.st_gid, stat.S_IMODE(status.st_mode)) == (1234, 4321, 0o600)


@pytest.mark.parametrize("there", [True, False])
def test_a_link_stays_a_link_and_its_file_is_written(tmp_path, there):
    (tmp_path / "elsewhere").mkdir()
    target, link = tmp_path / "elsewhere" / "file.bin", tmp_path / "link.bin"
    if there:
        target.write_bytes(OLD)
    link.symlink_to("elsewhere/file.bin")
    check_writable(link)
    with atomic_write(link) as temporary:
        temporary.write_bytes(NEW)
        assert temporary.parent.parent == target.parent  # on the same disk
    assert os.readlink(link) == "elsewhere/file.bin" and target.read_bytes() == NEW
    assert names(tmp_path) == ["elsewhere", "link.bin"] and names(target.parent) == ["file.bin"]


def made(kind: str, folder: Path) -> Path:
    """Something that is no file."""
    path = folder / "out.glb"
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "socket":
        here = os.getcwd()
        os.chdir(folder)  # names of sockets are short
        try:
            with socket.socket(socket.AF_UNIX) as listening:
                listening.bind(path.name)
        finally:
            os.chdir(here)
    elif kind == "folder":
        path.mkdir()
    elif kind == "loop":
        path.symlink_to(path.name)
    else:
        path.symlink_to(os.devnull)
    return path


@pytest.mark.parametrize(
    ("kind", "said"),
    {
        "pipe": "got a named pipe",
        "socket": "got a socket",
        "device": "got a device",
        "folder": "got a folder",
        "loop": "got Too many levels",
    }.items(),
)
def test_what_is_no_file_is_refused_and_stays(tmp_path, kind, said):
    path = made(kind, tmp_path)
    before = path.lstat()
    for attempt in (check_writable, write_new):
        with pytest.raises(BadOutput, match=f"cannot write .*out.glb; {said}"):
            attempt(path)
    after = path.lstat()
    assert (after.st_ino, after.st_mode) == (before.st_ino, before.st_mode)
    assert stat.S_ISCHR(os.stat(os.devnull).st_mode) and names(tmp_path) == ["out.glb"]


def write_new(path: Path) -> None:
    with atomic_write(path) as temporary:
        temporary.write_bytes(NEW)


def test_a_name_as_long_as_names_can_be_is_written(tmp_path):
    path = tmp_path / ("n" * 251 + ".bin")
    write_new(path)
    assert path.read_bytes() == NEW


def test_of_several_files_none_is_replaced_until_all_are_written(tmp_path):
    paths = [tmp_path / "one.obj", tmp_path / "two.pc2"]
    for path in paths:
        path.write_bytes(OLD)
    with atomic_writes(paths) as temporaries:
        assert [each.suffix for each in temporaries] == [".obj", ".pc2"]
        for temporary in temporaries:
            temporary.write_bytes(NEW)
        assert {path.read_bytes() for path in paths} == {OLD}
    assert {path.read_bytes() for path in paths} == {NEW} and names(tmp_path) == ["one.obj", "two.pc2"]
    with pytest.raises(BadOutput, match="cannot write .*two.pc2; got No such file"), atomic_writes(paths) as both:
        both[0].write_bytes(OLD)
    assert {path.read_bytes() for path in paths} == {NEW} and names(tmp_path) == ["one.obj", "two.pc2"]


def test_two_names_of_one_file_are_refused(tmp_path):
    (tmp_path / "two.obj").symlink_to("one.obj")
    both = [tmp_path / "one.obj", tmp_path / "two.obj"]
    with pytest.raises(BadOutput, match="two.obj; got a link to the file of .*one.obj"), atomic_writes(both):
        pass
    assert names(tmp_path) == ["two.obj"]


def test_many_files_need_few_open_ones(tmp_path):
    program = """
from hemline.files import atomic_writes
with atomic_writes([f"{number:04d}.obj" for number in range(200)]) as temporaries:
    for temporary in temporaries:
        temporary.write_bytes(b"v")
"""
    limited(program, tmp_path, most_files=40)
    assert names(tmp_path) == [f"{number:04d}.obj" for number in range(200)]


def test_a_folder_that_cannot_be_one_is_refused_with_the_reason(tmp_path):
    (tmp_path / "link").symlink_to("nowhere")
    with pytest.raises(BadOutput, match="link, which is a link to nothing"):
        check_folder(tmp_path / "link")
    with pytest.raises(BadOutput, match="which is a device"):
        check_folder(os.devnull)
    (tmp_path / "nowhere").mkdir()
    check_folder(tmp_path / "link" / "new")
