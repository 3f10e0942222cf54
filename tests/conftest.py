"""How tests share a machine: a worker of pytest-xdist keeps to one core, and waits asleep."""

import os
from pathlib import Path

import pytest

# what tests start in processes of their own may import `tests`, too
_ROOT = str(Path(__file__).parents[1])
os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [_ROOT, os.environ.get("PYTHONPATH")]))

IN_A_WORKER = "PYTEST_XDIST_WORKER" in os.environ
if IN_A_WORKER:
    # before numba, torch and BLAS are loaded: threads that wait awake take the cores from the other workers
    os.environ.setdefault("OMP_WAIT_POLICY", "passive")
    os.environ.setdefault("OMP_NUM_THREADS", "1")

from hemline.compiled import use_threads  # noqa: E402


@pytest.fixture(autouse=True)
def _one_core() -> None:
    """Kernels of a worker use one thread: with two each, the simulator's tests take a quarter more time."""
    if IN_A_WORKER:
        use_threads(1)


@pytest.fixture
def all_threads(_one_core) -> None:
    """All threads, in a worker too: for what is said of parallel loops and of crowds."""
    use_threads(None)
