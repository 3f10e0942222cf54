"""Takes from the workers of a dask scheduler: the same bytes, whoever is killed; and what is said where it fails."""

import hashlib
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("distributed", reason="a cluster needs dask.distributed (extra 'cluster')")
from hemline import bodies, garments, motions, sim
from hemline.cli import main
from hemline.datasets import open_dataset
from hemline.errors import BadInput, MissingExtra
from hemline.sim.takes import cluster
from hemline.sim.takes.workers import workers
from tests.sim.dask_cluster import DaskCluster, dask_cluster  # after the skip

CLIPS = ("walk", "kick", "run")

SCRIPT = """
import os, signal, sys
from pathlib import Path
from tests.sim.takes.test_sim_cluster import make
from hemline.errors import BadCluster

def busy(address):
    from distributed import Client
    with Client(address, set_as_default=False) as client:
        pids = client.run(os.getpid)
        calls = client.processing().items()
        return [pids[worker] for worker, keys in calls if any("_simulate_part" in k for k in keys)]

def report(name, done, total):
    heard.append((name, done, total))
    if whom != "nobody" and not killed and done > 2:
        killed.append(busy(scheduler)[0] if whom == "worker" else int(whom))
        os.kill(killed[0], signal.SIGKILL)

if __name__ == "__main__":
    folder, scheduler, whom = sys.argv[1:]
    killed, heard = [], []
    try:
        make(Path(folder), scheduler=scheduler, report=report)
    except BadCluster as error:
        print(error)
        sys.exit(2)
    print("killed", *killed)
    print("names", *sorted(set(name for name, _, _ in heard)))
    print("frames", *(max(done for name, done, _ in heard if name == one) for one, _, _ in heard[:3]))
"""


def make(folder: Path, **options):
    """Three clips of a second, each in two parts, of a napkin of 66 vertices."""
    napkin = garments.make_cape(bodies.load("anny24").shaped(), rows=6, columns=11, name="napkin")
    clips = [sim.ClipRequest(motions.load(name)[:25], motions.subject_of(name)) for name in CLIPS]
    settings = sim.SimSettings(settle=0.2, lead_in=0.3)
    return sim.produce(folder, napkin, clips, settings=settings, part_seconds=0.4, **options)


def digests(folder: Path) -> dict[str, str]:
    files = [folder / "garment.safetensors", *sorted((folder / "takes").glob("[!.]*"))]
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def run(tmp_path: Path, cluster: DaskCluster, whom: object) -> subprocess.CompletedProcess:
    """Make the dataset by a cluster, and kill somebody in the middle."""
    script = tmp_path / "run.py"
    script.write_text(SCRIPT)
    command = [sys.executable, str(script), str(tmp_path / "data"), cluster.address, str(whom)]
    path = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    return subprocess.run(command, capture_output=True, text=True, timeout=300, env=path, check=False)


def command(folder: Path, cluster: DaskCluster, *more: str) -> list[str]:
    words = [sys.executable, "-m", "hemline", "simulate", "cape-light", "-m", "walk", "--seconds", "0.1"]
    return [*words, "-o", str(folder), "--scheduler", cluster.address, *more]


@pytest.fixture(scope="module")
def alone(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("alone") / "data"
    assert not any(row.failed for row in make(folder))
    return folder


@pytest.mark.slow
def test_three_workers_one_of_them_killed_make_the_same_bytes(alone, tmp_path):
    with dask_cluster(tmp_path / "dask", 3) as cluster:
        done = run(tmp_path, cluster, "worker")
        dead = [process.pid for process in cluster.processes if process.poll() is not None]
        assert done.returncode == 0, done.stdout + done.stderr + cluster.said()
        killed, names, frames = (line.split() for line in done.stdout.splitlines())
        assert [int(killed[1])] == dead, "a worker that was simulating is gone"
        assert names[1:] == sorted(CLIPS), "all workers are heard of in one place"
        assert frames[1:] == ["25"] * 3
    assert digests(tmp_path / "data") == digests(alone)
    assert not list((tmp_path / "data" / "takes").glob(".*"))


@pytest.mark.slow
def test_a_scheduler_that_goes_away_is_said_and_what_is_done_is_kept(alone, tmp_path):
    with dask_cluster(tmp_path / "dask", 2) as cluster:
        done = run(tmp_path, cluster, cluster.scheduler.pid)
        assert done.returncode == 2, done.stdout + done.stderr
        said = f"the scheduler at {cluster.address} went away; got .*; run the same command again: what is done is kept"
        assert len(done.stdout.splitlines()) == 1
        assert re.fullmatch(said, done.stdout.strip())
    kept = {path: path.stat().st_mtime_ns for path in (tmp_path / "data" / "takes").glob("[!.]*")}
    assert kept
    make(tmp_path / "data")
    assert {path: path.stat().st_mtime_ns for path in kept} == kept
    assert digests(tmp_path / "data") == digests(alone)


def test_no_scheduler(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(cluster, "CONNECT_TIMEOUT", 1.0)
    words = ["simulate", "cape-light", "-m", "walk", "-o", str(tmp_path / "d"), "--scheduler", "tcp://127.0.0.1:9"]
    assert main(words) == 2
    cure = "start one with 'dask scheduler' and name it as tcp://HOST:8786"
    got = f"no dask scheduler answers at tcp://127.0.0.1:9; got nothing within 1 s; {cure}"
    assert capsys.readouterr().err.splitlines()[1:] == [f"hemline: {got}"]
    assert not (tmp_path / "d").exists()


def other_hemline(folder: Path) -> Path:
    """This package, but of another version."""
    package = folder / "hemline"
    package.mkdir(parents=True)
    for path in Path(bodies.__file__).parents[1].iterdir():
        if path.name != "version.py":
            (package / path.name).symlink_to(path)
    (package / "version.py").write_text('VERSION = "0.0.1"\n')
    return folder


@pytest.mark.slow
@pytest.mark.parametrize(
    "which, said",
    [
        ("other", "cannot run this hemline; got hemline 0.0.1 .*; install hemline 0.1.0 .* there, as here"),
        ("none", "cannot run this hemline; got no hemline of this version; install hemline 0.1.0"),
        ("threads", "must have one thread: a take is simulated by one; got 2; start it with 'dask worker --nthreads 1"),
    ],
)
def test_workers_that_cannot_do_it_are_refused_before_anything_is_written(tmp_path, which, said):
    with dask_cluster(tmp_path / "dask", 0) as cluster:
        cluster.add_worker(path_of(tmp_path, which), threads=2 if which == "threads" else 1)
        cluster.wait_for(1)
        words = command(tmp_path / "data", cluster)
        done = subprocess.run(words, capture_output=True, text=True, timeout=120, check=False, env=with_path())
    assert done.returncode == 2, done.stderr
    _, line = done.stderr.splitlines()
    assert re.match(rf"hemline: worker tcp://\S+ {said}", line), line
    assert not list(tmp_path.glob("data/takes/*"))


@pytest.mark.slow
def test_a_worker_without_hemline_that_comes_later_is_refused_too(tmp_path):
    with dask_cluster(tmp_path / "dask", 0) as cluster:
        words = command(tmp_path / "data", cluster)
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        running = subprocess.Popen(words, env=with_path(), **pipes)
        _, first = running.stderr.readline(), running.stderr.readline()
        assert "has no worker; got none so far; this goes on when one comes" in first
        cluster.add_worker(path_of(tmp_path, "none"))
        rest = running.communicate(timeout=120)[1]
    assert running.returncode == 2
    assert rest.startswith("hemline: a worker has no hemline, or another one; got ") and rest.count("\n") == 1


def path_of(folder: Path, which: str) -> str | None:
    if which == "other":
        return str(other_hemline(folder / "other"))
    if which == "none":
        (folder / "none").mkdir()
        (folder / "none" / "hemline.py").write_text("raise ModuleNotFoundError(\"No module named 'hemline'\")\n")
        return str(folder / "none")
    return None


def with_path() -> dict[str, str]:
    return os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}


def test_jobs_and_a_scheduler_are_one_too_many():
    with pytest.raises(BadInput, match="jobs are processes of this machine.*got both; give one"), workers(2, "tcp://x"):
        pass


def test_without_dask_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MissingExtra, match=r"hemline\[cluster\]"), workers(1, "tcp://127.0.0.1:9"):
        pass


@pytest.mark.slow
def test_rests_and_anchors_are_shared_out_too(tmp_path):
    shaped = bodies.load("anny24").shaped()
    napkin = garments.make_cape(shaped, rows=6, columns=11, name="napkin")

    def settle(folder: Path, scheduler: str | None) -> None:
        (rest,) = sim.produce_rests(folder, napkin, [()], scheduler=scheduler)
        assert not isinstance(rest, str)
        (row,) = sim.produce_anchors(folder, napkin, [sim.Anchor(shaped.rest_pose)], scheduler=scheduler)
        assert row.failed is None

    settle(tmp_path / "here", None)
    with dask_cluster(tmp_path / "dask", 2) as there:
        settle(tmp_path / "there", there.address)
    assert digests(tmp_path / "here") == digests(tmp_path / "there")
    assert len(open_dataset(tmp_path / "there").rows()) == 2
