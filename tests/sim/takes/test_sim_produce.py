"""Datasets are made once: killed at any moment, on any number of processes, they come out the same."""

import hashlib
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
import tracemalloc
from pathlib import Path

import pytest

from hemline import bodies, garments, motions, sim
from hemline.datasets import open_dataset
from hemline.errors import BadDataset, HemlineWarning

SCRIPT = """
import sys
from pathlib import Path
from tests.sim.takes.test_sim_produce import make

if __name__ == "__main__":
    make(Path(sys.argv[1]), int(sys.argv[2]))
"""


def small_garment():
    return garments.make_cape(bodies.load("anny24").shaped(), rows=12, columns=24, name="napkin")


def make(folder: Path, jobs: int):
    """Two clips of a second, each in three parts, of a napkin of 288 vertices."""
    clips = [sim.ClipRequest(motions.load(name)[:31], motions.subject_of(name)) for name in ("walk", "kick")]
    settings = sim.SimSettings(settle=0.5, lead_in=0.5)
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
    settings = sim.SimSettings(settle=0.5, lead_in=0.5)
    clip = sim.ClipRequest(motions.load("walk")[:31], motions.subject_of("walk"))
    whole = sim.produce(tmp_path / "whole", small_garment(), [clip], settings=settings)
    dataset, other = open_dataset(folder), open_dataset(tmp_path / "whole")
    parts = [dataset.take(row) for row in rows if row.clip == "walk"]
    joined = b"".join(part.vertices.tobytes() for part in parts)
    assert joined == other.take(whole[0]).vertices.tobytes()


@pytest.mark.slow
def test_memory_does_not_grow_with_the_length_of_a_clip(tmp_path):
    garment = garments.make_cape(bodies.load("anny24").shaped(), rows=30, columns=40, name="cloth")
    settings = sim.SimSettings(settle=0.1, lead_in=0.1, newton_steps=1, substeps=1, residual_share=0.99)
    walk = motions.load("walk")

    def made(frames: int) -> None:
        clip = sim.ClipRequest(walk[:frames], "one")
        sim.produce(tmp_path / "data", garment, [clip], settings=settings, part_seconds=0.2)

    def peak_mb(frames: int) -> float:
        tracemalloc.start()
        made(frames)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return peak / 1e6

    made(4)  # the rest state, too
    short, long = peak_mb(12), peak_mb(36)
    # 24 more frames are 0.35 MB of vertices alone
    assert long < short + 0.1


def test_killed_at_random_moments_it_resumes_and_the_bytes_are_the_same(unbroken, tmp_path):
    folder = tmp_path / "data"
    script = tmp_path / "run.py"
    script.write_text(SCRIPT)
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
    script.write_text(SCRIPT)
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
    folder = tmp_path / "data"
    shutil.copytree(unbroken[0], folder)
    victim = open_dataset(folder).path(unbroken[1][1].name)
    victim.write_bytes(victim.read_bytes()[:200])
    with pytest.warns(HemlineWarning, match=f"{victim.name}.*it is kept as {victim.name}.damaged and made again"):
        make(folder, 1)
    aside = victim.with_name(f"{victim.name}.damaged")
    assert aside.stat().st_size == 200
    aside.unlink()
    assert digests(folder) == digests(unbroken[0])


def test_another_garment_is_refused(unbroken):
    other = garments.make_cape(bodies.load("anny24").shaped(), rows=12, columns=25, name="napkin")
    clip = sim.ClipRequest(motions.load("walk")[:3], "06")
    with pytest.raises(BadDataset, match="was made for another garment"):
        sim.produce(unbroken[0], other, [clip])


FULL = """
import resource, sys
from pathlib import Path
from tests.sim.takes.test_sim_produce import make
from hemline.errors import BadOutput

if __name__ == "__main__":
    folder = Path(sys.argv[1])
    limit = int(sys.argv[2])
    # files cannot grow beyond the limit, as on a disk that is full
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
    try:
        make(folder, int(sys.argv[3]))
    except BadOutput as error:
        print(error)
        sys.exit(2)
"""


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_full_disk_stops_with_an_error_and_the_run_goes_on_later(unbroken, tmp_path, jobs):
    folder, script = tmp_path / "data", tmp_path / "run.py"
    script.write_text(FULL)
    by_part = {row.part: open_dataset(unbroken[0]).path(row.name).stat().st_size for row in unbroken[1]}
    # the rest state and later parts have room, first parts with their lead-in have not
    shutil.copytree(unbroken[0], folder)
    takes = [open_dataset(folder).path(row.name) for row in unbroken[1]]
    for path in takes[3:]:
        path.unlink()
    kept = digests(folder)
    limit = (max(by_part[1], by_part[2]) + by_part[0]) // 2
    command = [sys.executable, str(script), str(folder), str(limit), str(jobs)]
    # kernels are in the cache by now: nothing but takes is written
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 2, done.stderr
    assert "cannot write" in done.stdout
    assert "File too large" in done.stdout
    assert digests(folder) == kept
    make(folder, 1)
    assert digests(folder) == digests(unbroken[0])


def test_two_processes_on_one_dataset_lose_nothing_and_make_nothing_twice(unbroken, tmp_path):
    folder, script = tmp_path / "data", tmp_path / "run.py"
    script.write_text(SCRIPT)
    commands = [[sys.executable, str(script), str(folder), "1"]] * 2
    # one thread each: two that wait awake on the same cores take minutes
    alone = os.environ | {"NUMBA_NUM_THREADS": "1"}
    running = [subprocess.Popen(command, stderr=subprocess.PIPE, env=alone) for command in commands]
    errors = [process.communicate(timeout=300)[1].decode() for process in running]
    assert [process.returncode for process in running] == [0, 0], errors
    assert digests(folder) == digests(unbroken[0])
    assert sorted(path.name for path in folder.iterdir()) == [
        "garment.safetensors",
        "manifest.json",
        "takes",
        "timings.jsonl",
    ]
    dataset = open_dataset(folder)
    dataset.verify()
    assert [row.name for row in dataset.rows()] == [row.name for row in open_dataset(unbroken[0]).rows()]
    for line in (folder / "timings.jsonl").read_text().splitlines():
        assert json.loads(line)["seconds"] > 0


RACE = """
import sys
from pathlib import Path
from tests.sim.takes.test_sim_produce import small_garment
from hemline.datasets import create
from hemline.errors import BadDataset
from dataclasses import replace

garment = replace(small_garment(), key_joint=sys.argv[2])
print("ready", flush=True)
sys.stdin.readline()
try:
    create(Path(sys.argv[1]), garment)
    print("made", garment.hash)
except BadDataset as error:
    print("refused", error)
"""


def test_of_two_garments_at_once_one_gets_the_folder(tmp_path):
    script = tmp_path / "run.py"
    script.write_text(RACE)
    commands = [[sys.executable, str(script), str(tmp_path / "data"), joint] for joint in ("neck", "spine3")]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    running = [subprocess.Popen(command, **pipes) for command in commands]
    # both have everything ready before either begins, however slow the machine is
    assert [process.stdout.readline() for process in running] == ["ready\n"] * 2
    for process in running:
        process.stdin.write("go\n")
        process.stdin.flush()
    said = sorted(process.communicate(timeout=120)[0].split()[0] for process in running)
    assert said == ["made", "refused"]
    assert [path.name for path in (tmp_path / "data").iterdir() if path.is_file()] == ["garment.safetensors"]
