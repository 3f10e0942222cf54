"""Threads give way to other programs: how busy these are is read from what Linux says."""

import os
import subprocess
import sys
import time

import pytest

from hemline.compiled import other_work
from hemline.compiled.other_work import STAT, OtherWork

TICKS = os.sysconf("SC_CLK_TCK") if hasattr(os, "sysconf") else 100


def stat_line(busy_seconds: float) -> str:
    return f"cpu  {round(busy_seconds * TICKS)} 0 0 999 5 0 0 0 0 0\ncpu0 1 1\n"


@pytest.mark.parametrize(
    ("busy_cores", "free"),
    [(0.0, 4), (0.4, 4), (0.6, 3), (1.0, 3), (2.6, 1), (4.0, 1), (9.0, 1)],
)
def test_each_core_that_others_keep_busy_is_left_to_them(tmp_path, monkeypatch, busy_cores, free):
    monkeypatch.setattr(other_work, "PERIOD", 0.0)
    stat = tmp_path / "stat"
    stat.write_text(stat_line(1000.0))
    work = OtherWork(4, stat)
    work.free_cores()
    began, own = time.monotonic(), time.process_time()
    time.sleep(0.2)
    passed, mine = time.monotonic() - began, time.process_time() - own
    stat.write_text(stat_line(1000.0 + busy_cores * passed + mine))
    assert work.free_cores() == free


@pytest.mark.parametrize("content", [None, "", "cpu one two", "intr 5"])
def test_where_nothing_is_said_all_cores_are_free(tmp_path, monkeypatch, content):
    monkeypatch.setattr(other_work, "PERIOD", 0.0)
    if content is not None:
        (tmp_path / "stat").write_text(content)
    work = OtherWork(4, tmp_path / "stat")
    assert [work.free_cores() for _ in range(3)] == [4, 4, 4]


@pytest.mark.skipif(not STAT.exists(), reason="this system does not say how busy its cores are")
def test_programs_that_never_rest_are_seen():
    cores = os.cpu_count() or 1
    loops = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(cores)]
    try:
        work = OtherWork(cores)
        work.free_cores()
        time.sleep(1.5)
        assert work.free_cores() <= max(1, cores // 2)
    finally:
        for loop in loops:
            loop.kill()
            loop.wait()
