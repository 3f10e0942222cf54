"""Several processes train as one does: same batches, the mean of their gradients, one checkpoint."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="learning needs torch (extra 'learn')")
from hemline.errors import BadCluster  # noqa: E402
from hemline.learning.fit.group import Group  # noqa: E402
from hemline.learning.fit.trainer import Checkpoint, Schedule, Trainer  # noqa: E402
from tests.learning.test_learning_trainer import EPOCHS, SCHEDULE, Line, trained  # noqa: E402  # after the skip

WORK = """
import os, sys
from pathlib import Path
import numpy as np
from tests.learning.test_learning_trainer import Line, SCHEDULE
from hemline.cli.main import BAD_INPUT
from hemline.learning.fit.group import join_group
from hemline.learning.fit.trainer import Checkpoint, Trainer

folder, stop = Path(sys.argv[1]), int(sys.argv[2])

def progress(done, total):
    if done == stop:
        os._exit(9)

with join_group() as group:
    line = Line()
    Trainer(line, SCHEDULE).run(checkpoint=Checkpoint(folder / "line.safetensors", "mark", 1), progress=progress)
    if group.first:
        np.save(folder / "weights.npy", np.concatenate([p.detach().numpy().ravel() for p in line.parameters]))
    (folder / f"bits{group.rank}").write_bytes(line.bits())
threads = [Path(f"/proc/self/task/{each}/comm").read_text() for each in os.listdir("/proc/self/task")]
(folder / f"threads{group.rank}").write_text("".join(threads))
"""


def together(folder: Path, count: int, stop: int = 0) -> subprocess.CompletedProcess:
    """Train the line in so many processes; they are killed after an epoch."""
    script = folder / "work.py"
    script.write_text(WORK)
    command = [sys.executable, "-m", "torch.distributed.run", "--standalone", "--nproc-per-node", str(count)]
    alone = os.environ | {"OMP_NUM_THREADS": "1", "PYTHONPATH": os.pathsep.join(sys.path)}
    words = [*command, str(script), str(folder), str(stop)]
    return subprocess.run(words, capture_output=True, text=True, timeout=240, env=alone, check=False)


def weights(line: Line) -> np.ndarray:
    return np.concatenate([p.detach().numpy().ravel() for p in line.parameters])


def test_shares_of_a_batch_are_even_and_make_it_whole():
    for count in range(1, 7):
        for size in range(20):
            shares = [np.arange(size)[Group(rank, count).own_slice(size)] for rank in range(count)]
            np.testing.assert_array_equal(np.concatenate(shares), np.arange(size))
            assert max(map(len, shares)) - min(map(len, shares)) <= 1


def test_the_gradient_of_a_batch_is_the_weighted_sum_of_those_of_its_shares():
    chosen, whole = np.arange(0, 33), Line()
    whole.loss(chosen, np.random.default_rng(5), slice(None)).backward()
    summed = [torch.zeros_like(p) for p in whole.parameters]
    for rank in range(4):
        line, mine = Line(), Group(rank, 4).own_slice(len(chosen))
        line.loss(chosen, np.random.default_rng(5), mine).backward()
        for total, p in zip(summed, line.parameters, strict=True):
            total += (mine.stop - mine.start) / len(chosen) * p.grad
    for total, p in zip(summed, whole.parameters, strict=True):
        np.testing.assert_allclose(total, p.grad, rtol=1e-5, atol=1e-6)


@pytest.mark.slow
def test_two_processes_killed_and_gone_on_by_one_or_three_come_to_what_one_comes_to(tmp_path):
    whole = weights(trained(Line()))
    broken = together(tmp_path, 2, stop=5)
    assert broken.returncode != 0
    assert (tmp_path / "line.safetensors").exists()
    kept = (tmp_path / "line.safetensors").read_bytes()
    # 40 samples in batches of 16: three processes have uneven shares
    done = together(tmp_path, 3)
    assert done.returncode == 0, done.stderr
    bits = [(tmp_path / f"bits{rank}").read_bytes() for rank in range(3)]
    assert len(set(bits)) == 1, "all processes have the same bits"
    # a thread of gloo that outlives its group aborts the process at its end, one time in thirty
    assert not [rank for rank in range(3) if "gloo" in (tmp_path / f"threads{rank}").read_text()]
    np.testing.assert_allclose(np.load(tmp_path / "weights.npy"), whole, rtol=1e-5, atol=1e-6)
    (tmp_path / "line.safetensors").write_bytes(kept)
    seen: list[int] = []
    checkpoint = Checkpoint(tmp_path / "line.safetensors", "mark", 1)
    alone = trained(Line(), checkpoint, lambda epoch, total: seen.append(epoch))
    assert len(seen) in (EPOCHS - 4, EPOCHS - 5), "it went on from what the two had kept"
    np.testing.assert_allclose(weights(alone), whole, rtol=1e-5, atol=1e-6)


def test_more_processes_than_samples_in_a_batch_are_refused(monkeypatch):
    monkeypatch.setattr(Group, "current", classmethod(lambda cls: cls(0, 17)))
    with pytest.raises(BadCluster, match="line has 16 samples in a batch.*got 17 processes; start fewer"):
        Trainer(Line(), SCHEDULE)
    assert Trainer(Line(), Schedule(1, 17, 0.1, 0, 1)).group.count == 17
