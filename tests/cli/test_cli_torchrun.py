"""`hemline fit` by torchrun: one model, one print, the same figures as by one process."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("torch", reason="learning needs torch (extra 'learn')")
from hemline import bodies, garments, motions, sim  # after the skip

OPTIONS = ["--epochs", "4", "--components", "8"]
OPTIONS += ["--shape-components", "8", "--chains", "4", "--threads", "1"]
OPTIONS += ["--no-calibrate", "--collision-vertices", "20"]


@pytest.fixture(scope="module")
def data(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("torchrun") / "data"
    napkin = garments.make_cape(bodies.load("anny24").shaped(), rows=8, columns=12, name="napkin")
    clips = [sim.ClipRequest(motions.load(name)[:40], motions.subject_of(name)) for name in ("walk", "run", "kick")]
    settings = sim.SimSettings(settle=0.2, lead_in=0.3, substeps=1)
    assert not any(row.failed for row in sim.produce(folder, napkin, clips, settings=settings))
    return folder


def fitted(data: Path, model: Path, processes: int, *more: str) -> subprocess.CompletedProcess:
    start = [sys.executable]
    if processes > 1:
        start += ["-m", "torch.distributed.run", "--standalone", "--nproc-per-node", str(processes)]
    words = [*start, "-m", "hemline", "fit", str(data), "-o", str(model), "--json", *OPTIONS, *more]
    alone = {"OMP_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1", "PYTHONPATH": os.pathsep.join(sys.path)}
    return subprocess.run(words, capture_output=True, text=True, timeout=400, env=os.environ | alone, check=False)


@pytest.mark.slow
def test_two_processes_fit_what_one_fits(data, tmp_path):
    one, two = fitted(data, tmp_path / "one.safetensors", 1), fitted(data, tmp_path / "two.safetensors", 2)
    assert one.returncode == two.returncode == 0, one.stderr + two.stderr
    (said,) = two.stdout.splitlines()
    figures, others = json.loads(one.stdout)["figures"], json.loads(said)["figures"]
    assert figures.keys() == others.keys()
    for name, figure in figures.items():
        assert others[name] == pytest.approx(figure, rel=1e-3, abs=1e-3), name
    assert sorted(path.name for path in tmp_path.iterdir()) == ["one.safetensors", "two.safetensors"]


@pytest.mark.slow
def test_more_processes_than_a_batch_has_samples_are_one_line(data, tmp_path):
    done = fitted(data, tmp_path / "model.safetensors", 2, "--batch", "1")
    assert done.returncode != 0
    said = [line for line in done.stderr.splitlines() if line.startswith("hemline: ")]
    (line,) = [line for line in said if not line.startswith("hemline: warning: ")]
    assert "has 1 samples in a batch, one process each; got 2 processes; start fewer, or raise the batch" in line
    assert not (tmp_path / "model.safetensors").exists()
