"""Datasets are made once: killed at any moment, on any number of processes, they come out the same."""

import hashlib
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from hemline import bodies, garments, motions, sim
from hemline.datasets import open_dataset
from hemline.errors import BadDataset

SCRIPT = """
import sys
from pathlib import Path
sys.path.insert(0, {here!r})
from test_sim_produce import make

if __name__ == "__main__":
    make(Path(sys.argv[1]), int(sys.argv[2]))
"""


def small_garment():
    return garments.make_cape(bodies.load("anny24").shaped(), rows=10, columns=16, name="napkin")


def make(folder: Path, jobs: int):
    """Two clips of a second, each in three parts, of a napkin of 160 vertices."""
    clips = [sim.Clip(motions.load(name)[:31], motions.subject_of(name)) for name in ("walk", "kick")]
    settings = sim.SimSettings(settle=0.5, lead_in=1.0)
    return sim.produce(folder, small_garment(), clips, settings=settings, jobs=jobs, part_seconds=0.4)


def digests(folder: Path) -> dict[str, str]:
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted((folder / "takes").glob("*"))}


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory):
    folder = tmp_path_factory.mktemp("unbroken") / "data"
    return folder, make(folder, 1)


def test_rows_come_in_the_order_of_clips_and_parts(unbroken):
    _, rows = unbroken
    assert [(row.clip, row.part) for row in rows] == [("walk", i) for i in range(3)] + [("kick", i) for i in range(3)]
    assert not any(row.failed for row in rows)
    assert [row.clip_frames for row in rows] == [12, 12, 7] * 2
    assert all(row.frames > row.clip_frames for row in rows if row.part == 0)


def test_a_second_run_makes_nothing(unbroken):
    folder, rows = unbroken
    stamps = {path: path.stat().st_mtime_ns for path in (folder / "takes").iterdir()}
    assert make(folder, 1) == rows
    assert {path: path.stat().st_mtime_ns for path in (folder / "takes").iterdir()} == stamps


def test_parts_join_to_what_one_part_would_have_been(unbroken, tmp_path):
    folder, rows = unbroken
    settings = sim.SimSettings(settle=0.5, lead_in=1.0)
    clip = sim.Clip(motions.load("walk")[:31], motions.subject_of("walk"))
    whole = sim.produce(tmp_path / "whole", small_garment(), [clip], settings=settings)
    dataset, other = open_dataset(folder), open_dataset(tmp_path / "whole")
    parts = [dataset.take(row) for row in rows if row.clip == "walk"]
    joined = b"".join(part.vertices.tobytes() for part in parts)
    assert joined == other.take(whole[0]).vertices.tobytes()


def test_killed_at_random_moments_it_resumes_and_the_bytes_are_the_same(unbroken, tmp_path):
    folder = tmp_path / "data"
    script = tmp_path / "run.py"
    script.write_text(SCRIPT.format(here=str(Path(__file__).parent)))
    command = [sys.executable, str(script), str(folder), "2"]
    chance = random.Random(7)
    for _ in range(3):
        process = subprocess.Popen(command, start_new_session=True)
        time.sleep(chance.uniform(2.0, 6.0))
        process.send_signal(signal.SIGKILL)
        process.wait()
    subprocess.run(command, check=True, timeout=300)
    assert digests(folder) == digests(unbroken[0])
    assert not [path for path in (folder / "takes").iterdir() if path.name.startswith(".") and path.stat().st_size]


@pytest.mark.skipif(not hasattr(os, "getppid"), reason="needs a parent process to ask for")
def test_workers_end_with_their_parent(tmp_path):
    script = tmp_path / "run.py"
    script.write_text(SCRIPT.format(here=str(Path(__file__).parent)))
    process = subprocess.Popen([sys.executable, str(script), str(tmp_path / "data"), "2"], start_new_session=True)
    time.sleep(4.0)
    process.kill()
    process.wait()
    deadline = time.monotonic() + 20
    while time.monotonic() < deadline and _alive(process.pid):
        time.sleep(0.25)
    assert not _alive(process.pid)


def _alive(group: int) -> bool:
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True


def test_a_damaged_take_is_made_again(unbroken, tmp_path):
    import shutil

    folder = tmp_path / "data"
    shutil.copytree(unbroken[0], folder)
    victim = open_dataset(folder).path(unbroken[1][1].name)
    victim.write_bytes(victim.read_bytes()[:200])
    make(folder, 1)
    assert digests(folder) == digests(unbroken[0])


def test_another_garment_is_refused(unbroken):
    other = garments.make_cape(bodies.load("anny24").shaped(), rows=10, columns=17, name="napkin")
    clip = sim.Clip(motions.load("walk")[:3], "06")
    with pytest.raises(BadDataset, match="was made for another garment"):
        sim.produce(unbroken[0], other, [clip])
