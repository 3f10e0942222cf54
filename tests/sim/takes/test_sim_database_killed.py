"""A database that is killed while it is made: run again, it is finished, and nothing that was there is made anew."""

import hashlib
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from hemline import garments, motions
from hemline.garments import coarser_garment
from hemline.sim import make_database
from hemline.sim.takes import database

SCRIPT = """
import sys
from pathlib import Path
from tests.sim.takes.test_sim_database_killed import make

if __name__ == "__main__":
    make(Path(sys.argv[1]))
"""
MINUTES = 10


def make(folder: Path):
    """Two anchors and three poses on the mean shape of the body alone, of a shirt of 315 vertices."""
    database.SHAPE_BETAS = 0
    garment, _ = coarser_garment(garments.load("tshirt-light"), 0.1)
    return make_database(folder, garment, [motions.load("walk")[:60]], 2, beside=3)


def stamps(folder: Path) -> dict[str, int]:
    return {path.name: path.stat().st_mtime_ns for path in (folder / "takes").glob("[!.]*")}


def digests(folder: Path) -> dict[str, str]:
    files = [folder / "garment.safetensors", *sorted((folder / "takes").glob("*"))]
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def kill_with(folder: Path, script: Path, count: int) -> dict[str, int]:
    """Kill the process as soon as there are so many takes; what was there, by its time of writing."""
    process = subprocess.Popen([sys.executable, str(script), str(folder)], start_new_session=True)
    deadline = time.monotonic() + 60 * MINUTES
    while len(stamps(folder)) < count and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.01)
    assert process.poll() is None, "it ended before it was killed"
    process.send_signal(signal.SIGKILL)
    assert process.wait() == -signal.SIGKILL
    return stamps(folder)


@pytest.mark.slow
def test_killed_in_the_middle_it_goes_on_to_the_same_bytes(tmp_path):
    script, folder = tmp_path / "run.py", tmp_path / "killed"
    script.write_text(SCRIPT)
    for count in (1, 2):
        there = kill_with(folder, script, count)
        assert len(there) >= count
    subprocess.run([sys.executable, str(script), str(folder)], check=True, timeout=60 * MINUTES)
    after = stamps(folder)
    assert len(after) > len(there) and {name: after[name] for name in there} == there, "what was there is kept"
    subprocess.run([sys.executable, str(script), str(tmp_path / "whole")], check=True, timeout=60 * MINUTES)
    assert digests(folder) == digests(tmp_path / "whole")
    assert not [path for path in (folder / "takes").glob(".*") if path.stat().st_size], "no half-written take is left"
