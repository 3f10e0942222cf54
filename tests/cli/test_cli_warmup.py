"""`hemline warmup`: what it compiles is not compiled again."""

import os
import signal
import subprocess
import sys
import time

import pytest

from hemline.cli.main import main
from hemline.playback.warmup import STAGES

PLAY = """
import hemline
for name in ("cape", "tshirt-light"):
    body = hemline.bodies.load("anny24").shaped()
    list(hemline.play(hemline.load(name), body, hemline.motions.load("run")[:3]))
"""


def test_no_process_is_refused(capsys):
    assert main(["warmup", "--jobs", "0"]) == 2
    assert "--jobs must be at least 1; got 0" in capsys.readouterr().err


@pytest.mark.slow
def test_what_two_processes_compiled_is_there_for_a_third(tmp_path):
    environment = os.environ | {"HEMLINE_CACHE_DIR": str(tmp_path), "HEMLINE_KERNEL_PACK": "none"}
    command = [sys.executable, "-m", "hemline", "warmup", "--jobs", "2"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    assert all(name in done.stderr for name in STAGES) and done.stdout.strip() == str(tmp_path)
    compiled = set(tmp_path.rglob("*.kernel"))
    subprocess.run([sys.executable, "-c", PLAY], env=environment, check=True)
    assert compiled and set(tmp_path.rglob("*.kernel")) == compiled


@pytest.mark.skipif(not hasattr(os, "killpg"), reason="a terminal's Ctrl-C is a signal to a group of processes")
def test_ctrl_c_ends_it_at_once_while_compilers_are_at_work(tmp_path):
    command = [sys.executable, "-m", "hemline", "warmup", "--jobs", "2"]
    environment = os.environ | {"HEMLINE_CACHE_DIR": str(tmp_path), "HEMLINE_KERNEL_PACK": "none"}
    options = {"stderr": subprocess.PIPE, "text": True, "start_new_session": True, "preexec_fn": _hear_ctrl_c}
    with subprocess.Popen(command, env=environment, **options) as run:
        while not any(tmp_path.rglob("*.kernel")):
            assert run.poll() is None
            time.sleep(0.1)
        began = time.monotonic()
        os.killpg(run.pid, signal.SIGINT)
        _, said = run.communicate(timeout=60)
    assert time.monotonic() - began < 5
    assert run.returncode == 130 and "interrupted" in said.splitlines()[-1]


def _hear_ctrl_c() -> None:
    """A shell has what it starts in the background ignore Ctrl-C, and what that starts in turn."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@pytest.mark.skipif(not hasattr(os, "killpg"), reason="a kill that cannot be heard is a signal")
def test_its_processes_end_with_it_when_it_is_killed(tmp_path):
    command = [sys.executable, "-m", "hemline", "warmup", "--jobs", "2"]
    environment = os.environ | {"HEMLINE_CACHE_DIR": str(tmp_path), "HEMLINE_KERNEL_PACK": "none"}
    run = subprocess.Popen(command, env=environment, stderr=subprocess.DEVNULL, start_new_session=True)
    while not any(tmp_path.rglob("*.kernel")):
        assert run.poll() is None
        time.sleep(0.1)
    run.kill()
    run.wait()
    deadline = time.monotonic() + 20
    while _is_alive(run.pid):
        assert time.monotonic() < deadline
        time.sleep(0.1)


def _is_alive(group: int) -> bool:
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True
