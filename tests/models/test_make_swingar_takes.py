"""What `swingar` learns from: clips are dealt out evenly, and the workers of a cluster make the same bytes."""

import collections
import hashlib
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from hemline import motions
from hemline.models.make.swingar_takes import BODIES, SPEEDS, body_shapes, deal_parts, design_names, folder_of, main

CLIPS = ("walk", "run")


def test_clips_come_equally_often_and_each_garment_on_two_bodies():
    clips = [Path(name) for name in "abcde"]
    shapes = body_shapes(None, BODIES, 3)
    dealt = deal_parts(clips, 10, 4, 3, shapes)
    assert [len(each) for each in dealt] == [4] * 10
    assert set(collections.Counter(part.clip for each in dealt for part in each).values()) == {8}
    assert all(len({part.betas for part in each}) == 2 for each in dealt)
    assert all(tuple(part.speed for part in each) == SPEEDS for each in dealt)
    assert len({part.betas for each in dealt for part in each}) == BODIES
    assert dealt == deal_parts(clips, 10, 4, 3, shapes) != deal_parts(clips, 10, 4, 4, shapes)


def test_bodies_can_be_given():
    dealt = deal_parts([Path("a")], 3, 2, 0, body_shapes([(3.0, -3.0), (-3.0,)], BODIES, 0))
    assert all([part.betas[:3] for part in each] == [(3.0, -3.0, 0.0), (-3.0, 0.0, 0.0)] for each in dealt)


def test_random_designs_are_of_all_kinds_and_half_of_them_fit_closely():
    names = design_names(20, first=7, edge=0.045)
    assert len(set(names)) == 20
    assert sum(name.startswith("close-") for name in names) == 10
    kinds = collections.Counter(name.removeprefix("close-").partition(":")[0] for name in names)
    assert set(kinds.values()) == {4}
    assert names[0] == "top:7@45"
    assert set(names).isdisjoint(design_names(20, first=11, edge=0.045))


def test_a_body_that_is_no_numbers_is_refused(folder, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", command(folder, "out", "--betas=tall")[2:])
    with pytest.raises(SystemExit):
        main()
    assert "--betas: must be numbers; got 'tall'; write a body as 3,-3" in capsys.readouterr().err
    assert not (folder / "out").exists()


def test_a_folder_is_named_after_the_garment_or_its_file():
    assert folder_of("dress:7@35") == "dress-7@35"
    assert folder_of("some/where/my dress.obj") == "my_dress"


@pytest.mark.parametrize(
    "more, said",
    [
        (
            ("--jobs", "2", "--scheduler", "tcp://127.0.0.1:9"),
            "jobs are processes.*; got both; give one",
        ),
        (("--only", "walk.bvh"), "cannot read .*walk.bvh; got No such file or directory; name a BVH file"),
    ],
)
def test_bad_input_is_one_line_and_nothing_is_written(folder, monkeypatch, more, said):
    monkeypatch.setattr(sys, "argv", command(folder, "out", *more)[2:])
    with pytest.raises(SystemExit) as ended:
        main()
    assert re.fullmatch(f"hemline: {said}", str(ended.value))
    assert not (folder / "out").exists()


def command(folder: Path, output: str, *more: str) -> list[str]:
    """Two short takes of each of two small garments."""
    words = [sys.executable, "-m", "hemline.models.make.swingar_takes", str(folder / "clips"), "cape-light"]
    words += ["skirt-light", "-o", str(folder / output), "--only", *(f"{name}.safetensors" for name in CLIPS)]
    return [*words, "--takes", "2", "--seconds", "0.4", "--most", "100", *more]


@pytest.fixture
def folder(tmp_path) -> Path:
    (tmp_path / "clips").mkdir()
    for name in CLIPS:
        motions.write(tmp_path / "clips" / f"{name}.safetensors", motions.load(name))
    return tmp_path


def digests(folder: Path) -> dict[str, str]:
    files = [*folder.glob("*/garment.safetensors"), *folder.glob("*/takes/*")]
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


@pytest.mark.slow
def test_a_cluster_one_of_whose_workers_is_killed_makes_the_same_bytes(folder):
    pytest.importorskip("distributed", reason="a cluster needs dask.distributed (extra 'cluster')")
    from tests.sim.dask_cluster import dask_cluster

    path = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path), "NUMBA_NUM_THREADS": "1"}
    here = subprocess.run(command(folder, "here"), capture_output=True, text=True, timeout=600, env=path, check=False)
    assert here.returncode == 0, here.stderr
    assert "failed" not in here.stdout and "left out" not in here.stdout, here.stdout
    with dask_cluster(folder / "dask", 2) as cluster:
        words = command(folder, "there", "--scheduler", cluster.address)
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        running = subprocess.Popen(words, env=path, **pipes)
        deadline = time.monotonic() + 300
        while not list(folder.glob("there/*/takes/[!.]*")) and time.monotonic() < deadline:
            time.sleep(0.05)
        cluster.processes[-1].send_signal(signal.SIGKILL)
        said, wrong = running.communicate(timeout=600)
    assert running.returncode == 0, wrong
    without_times = [line for line in said.splitlines() if line[0].isalpha()]
    assert without_times == [line for line in here.stdout.splitlines() if line[0].isalpha()]
    made = digests(folder / "there")
    assert made == digests(folder / "here")
    assert sum("/takes/" in name for name in made) == 4 + 4  # a rest state for each body


@pytest.mark.slow
def test_a_scheduler_that_is_not_there_is_one_line(folder):
    words = command(folder, "out", "--scheduler", "tcp://127.0.0.1:9")
    done = subprocess.run(words, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 1
    assert done.stderr.startswith("hemline: no dask scheduler answers at tcp://127.0.0.1:9; got nothing within 10 s")
    assert done.stderr.count("\n") == 1 and not (folder / "out").exists()
