"""How many threads kernels use, and that no number of them, nor any pool that numba has, ends the process."""

import math
import threading
from pathlib import Path

import pytest

from hemline.compiled import at_most, available, real_time_threads, threads, use_threads
from hemline.compiled.threads import _quota
from tests.compiled.kernel_package import run, write_package

MANY_AT_ONCE = """
import threading
import numpy as np
from hemline.compiled import use_threads
from own.outer_kernels import fill

use_threads({count})
barrier = threading.Barrier(4)
results = [np.zeros(100_000) for _ in range(4)]

def work(out):
    barrier.wait()
    for _ in range(200):
        fill(out)

each = [threading.Thread(target=work, args=(out,)) for out in results]
[thread.start() for thread in each]
[thread.join() for thread in each]
print(len({{out.sum() for out in results}}))
"""
CROWD = """
import hemline
body, run = hemline.bodies.load("anny24").shaped(), hemline.motions.load("run")
garment = hemline.garments.load("tshirt-light")
players = [hemline.Player.prepare(hemline.load("live").animator_for(garment, body), body) for _ in range(2)]
states = [player.start(run[0]) for player in players]
for index in range(3):
    states, frames = hemline.crowd(players, states, [run[index]] * 2, 1 / 30)
print((frames[0].vertices == frames[1].vertices).all())
"""


@pytest.fixture(autouse=True)
def _no_number_chosen():
    use_threads(None)
    yield
    use_threads(None)


def test_work_done_ahead_uses_all_threads_and_what_is_shown_uses_one():
    use_threads(None)
    assert threads() == available() >= 1
    with real_time_threads():
        assert threads() == 1
    assert threads() == available()


def test_a_chosen_number_holds_for_both():
    use_threads(available())
    with real_time_threads():
        assert threads() == available()
    use_threads(1)
    assert threads() == 1


@pytest.mark.parametrize(("asked", "given"), [(0, 1), (-3, 1), (10**6, available())])
def test_a_number_beyond_what_there_is_becomes_the_nearest(asked, given):
    use_threads(asked)
    assert threads() == given


def test_limits_within_limits_only_tighten_and_belong_to_their_thread():
    seen = []
    with at_most(1), at_most(5):
        assert threads() == 1
        other = threading.Thread(target=lambda: seen.append(threads()))
        other.start()
        other.join()
    assert seen == [available()] == [threads()]


@pytest.mark.parametrize(
    ("files", "cores"),
    [
        ({"cpu.max": "150000 100000"}, 1.5),
        ({"cpu.max": "max 100000"}, math.inf),
        ({"cpu.max": "max 100000", "pod/cpu.max": "400000 100000", "pod/box/cpu.max": "50000 100000"}, 0.5),
        ({"cpu/cpu.cfs_quota_us": "200000", "cpu/cpu.cfs_period_us": "100000"}, 2.0),
        ({"cpu/cpu.cfs_quota_us": "-1", "cpu/cpu.cfs_period_us": "100000"}, math.inf),
        ({"cpu.max": "nonsense"}, math.inf),
        ({}, math.inf),
    ],
)
def test_the_limit_of_a_container_is_read(tmp_path: Path, files, cores):
    for name, content in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(content)
    (tmp_path / "own").write_text("0::/pod/box\n")
    assert _quota(tmp_path, tmp_path / "own") == cores


@pytest.mark.parametrize("layer", ["workqueue", "default"])
@pytest.mark.parametrize("count", [1, 2])
def test_threads_that_call_a_parallel_kernel_at_once_agree(tmp_path, layer, count):
    write_package(tmp_path)
    done = run(MANY_AT_ONCE.format(count=count), tmp_path, tmp_path / "cache", NUMBA_THREADING_LAYER=layer)
    assert (done.returncode, done.stdout.strip()) == (0, "1"), done.stderr


def test_a_crowd_of_simulated_garments_goes_on_where_numba_has_no_openmp(tmp_path):
    done = run(CROWD, tmp_path, NUMBA_THREADING_LAYER="workqueue")
    assert (done.returncode, done.stdout.strip()) == (0, "True"), done.stderr


def test_waiting_threads_sleep_soon_and_the_environment_is_left_as_it_was(tmp_path):
    write_package(tmp_path)
    code = (
        "import os; before = dict(os.environ); import numpy as np; from own.outer_kernels import fill; "
        "fill(np.zeros(10)); print(dict(os.environ) == before)"
    )
    assert run(code, tmp_path, tmp_path / "cache").stdout.strip() == "True"
