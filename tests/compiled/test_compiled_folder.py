"""The folder of compiled kernels: nobody else can write to the one that hemline chooses."""

import os
import stat
import subprocess

import pytest

from tests.compiled.kernel_package import ANSWER, ask, kept, run, write_package

ROOT = hasattr(os, "geteuid") and os.geteuid() == 0
OTHER = 65534
"""A user who is not this one."""
FOLDER = "from hemline.compiled import cache_folder; print(cache_folder())"


def homeless(code: str, tmp_path, temporary) -> subprocess.CompletedProcess[str]:
    """Run code where neither home nor cache can be written, with a folder for temporary files."""
    nowhere = "/proc/none" if os.path.isdir("/proc") else "/dev/null/none"
    return run(code, tmp_path, HOME=nowhere, XDG_CACHE_HOME="", HEMLINE_CACHE_DIR="", TMPDIR=str(temporary))


def test_the_cache_of_the_user_comes_first(tmp_path):
    done = run(FOLDER, tmp_path, HOME=str(tmp_path), XDG_CACHE_HOME="", HEMLINE_CACHE_DIR="")
    assert done.stdout.strip() == str(tmp_path / ".cache" / "hemline") and done.stderr == ""
    assert stat.S_IMODE((tmp_path / ".cache" / "hemline").stat().st_mode) == 0o700


def test_without_a_home_a_folder_of_this_user_serves(tmp_path):
    done = homeless(FOLDER, tmp_path, tmp_path)
    folder = tmp_path / f"hemline-{os.geteuid()}"
    assert done.stdout.strip() == str(folder) and done.stderr == ""
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    assert homeless(FOLDER, tmp_path, tmp_path).stdout.strip() == str(folder)


def test_a_link_in_its_place_is_not_followed(tmp_path):
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / f"hemline-{os.geteuid()}").symlink_to(tmp_path / "elsewhere")
    done = homeless(FOLDER, tmp_path, tmp_path)
    assert done.returncode == 0
    assert done.stdout.strip() not in ("", str(tmp_path / f"hemline-{os.geteuid()}"))
    assert "kept until this process ends" in done.stderr
    assert list((tmp_path / "elsewhere").iterdir()) == []
    assert not os.path.exists(done.stdout.strip()), "the folder of one process is removed at its end"


@pytest.mark.skipif(not ROOT, reason="only root can make folders and files of another user")
def test_a_folder_of_another_user_is_not_used(tmp_path):
    planted = tmp_path / f"hemline-{os.geteuid()}"
    planted.mkdir()
    planted.chmod(0o777)
    os.chown(planted, OTHER, OTHER)
    done = homeless(FOLDER, tmp_path, tmp_path)
    assert done.stdout.strip() != str(planted) and "kept until this process ends" in done.stderr
    assert list(planted.iterdir()) == []


@pytest.mark.skipif(not ROOT, reason="only root can make folders and files of another user")
def test_a_file_of_another_user_is_not_run(tmp_path):
    """It is compiled and written anew, though it is valid in every other way."""
    write_package(tmp_path, factor=7)
    assert homeless(ANSWER, tmp_path, tmp_path).stdout.strip() == "140"
    folder = tmp_path / f"hemline-{os.geteuid()}"
    planted = [each.relative_to(folder) for each in kept(folder)]
    for each in kept(folder):
        os.chown(each, OTHER, OTHER)
        each.chmod(0o666)
    assert homeless(ANSWER, tmp_path, tmp_path).stdout.strip() == "140"
    assert all((folder / name).stat().st_uid == os.geteuid() for name in planted)


def test_a_folder_that_others_could_write_is_closed(tmp_path):
    folder = tmp_path / ".cache" / "hemline"
    folder.mkdir(parents=True)
    folder.chmod(0o777)
    done = run(FOLDER, tmp_path, HOME=str(tmp_path), XDG_CACHE_HOME="", HEMLINE_CACHE_DIR="")
    assert done.stdout.strip() == str(folder) and done.stderr == ""
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700


@pytest.mark.parametrize(("mode", "said"), [(0o700, ""), (0o770, "its group"), (0o777, "every user")])
def test_a_named_folder_is_used_and_it_is_said_who_can_write_there(tmp_path, mode, said):
    cache = tmp_path / "shared"
    cache.mkdir()
    cache.chmod(mode)
    done = run(FOLDER, tmp_path, cache)
    assert done.stdout.strip() == str(cache)
    assert said in done.stderr and ("runs code as you" in done.stderr) == bool(said)


def test_a_named_folder_that_cannot_be_made_is_said_and_another_one_serves(tmp_path):
    (tmp_path / "file").write_text("")
    done = run(FOLDER, tmp_path, tmp_path / "file" / "below", HOME=str(tmp_path), XDG_CACHE_HOME="")
    assert done.stdout.strip() == str(tmp_path / ".cache" / "hemline")
    assert "HEMLINE_CACHE_DIR cannot be used" in done.stderr


@pytest.mark.skipif(ROOT, reason="root can write everywhere")
def test_a_named_folder_that_can_only_be_read_serves_what_it_holds(tmp_path):
    write_package(tmp_path)
    cache = tmp_path / "cache"
    ask(tmp_path, cache)
    cache.chmod(0o500)
    assert ask(tmp_path, cache) == "40"
