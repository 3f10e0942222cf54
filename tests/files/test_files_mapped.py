"""Mapped arrays take their room on the disk when they are made, so that a full disk is an error and no signal."""

import os
import shutil
import subprocess
import sys
from collections import namedtuple

import numpy as np
import pytest

from hemline.errors import BadOutput
from hemline.files import create_mapped_array


def test_what_is_written_is_in_the_file(tmp_path):
    array = create_mapped_array(tmp_path / "a.npy", np.float16, (7, 3))
    assert not array.any()
    array[:] = np.arange(21).reshape(7, 3)
    del array
    np.testing.assert_array_equal(np.load(tmp_path / "a.npy"), np.arange(21).reshape(7, 3))


@pytest.mark.skipif(not hasattr(os, "posix_fallocate"), reason="room is taken by posix_fallocate, which is not here")
def test_all_of_its_room_is_taken_at_once(tmp_path):
    create_mapped_array(tmp_path / "a.npy", np.float32, (1000, 1000))
    assert 512 * (tmp_path / "a.npy").stat().st_blocks >= 4_000_000


def test_where_room_cannot_be_taken_it_is_looked_for(tmp_path, monkeypatch):
    monkeypatch.delattr(os, "posix_fallocate", raising=False)
    assert create_mapped_array(tmp_path / "a.npy", np.float32, (10,)).shape == (10,)
    monkeypatch.setattr(shutil, "disk_usage", lambda path: namedtuple("Usage", "free")(1000))
    with pytest.raises(BadOutput, match="cannot write .*b.npy; got No space left on device: 4 MB are needed; free"):
        create_mapped_array(tmp_path / "b.npy", np.float32, (1000, 1000))
    assert [path.name for path in tmp_path.iterdir()] == ["a.npy"]


def test_a_path_that_cannot_be_written_is_said(tmp_path):
    with pytest.raises(BadOutput, match="cannot write .*a.npy; got No such file"):
        create_mapped_array(tmp_path / "no" / "a.npy", np.float32, (10,))


FILLED = """
import sys
import numpy as np
from hemline.errors import BadOutput
from hemline.files import create_mapped_array
try:
    create_mapped_array(sys.argv[1], np.float32, (1000, 1000))[:] = 1
except BadOutput as error:
    print(error)
"""


def test_a_full_disk_is_a_line_and_no_signal(tmp_path):
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=300k", "tmpfs", str(disk)]
    if shutil.which("mount") is None or subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("a disk of 300 kB is needed: mounting one is not permitted here")
    try:
        command = [sys.executable, "-c", FILLED, str(disk / "a.npy")]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
        left = list(disk.iterdir())
    finally:
        subprocess.run(["umount", str(disk)], check=True)
    assert done.returncode == 0, done
    assert "got No space left on device: 4 MB are needed" in done.stdout and left == []
