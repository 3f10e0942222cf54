"""How many threads kernels use.

Work that is done ahead (a simulation, a fit) uses every core that this process may use and that other programs leave
free. What is made while it is shown uses one: threads that meet some thousand times a frame wait for the slowest of
them, so that on a machine that does something else a frame would take many times as long.
"""

import math
import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import numba
import numba.core.config
from numba.np.ufunc.parallel import threading_layer

from .other_work import OtherWork

_config: Any = numba.core.config
_here = threading.local()
_chosen: int | None = None
_SPINS = "1000"
"""Turns for which a thread of OpenMP waits awake; its default, 300,000, takes the cores from other programs."""
_launching = threading.Lock()
_one_at_a_time = threading.RLock()


@cache
def available() -> int:
    """Threads that kernels can use: no more than numba has, than this process may run on, or than its container has."""
    return max(1, math.ceil(min(_config.NUMBA_NUM_THREADS, _allowed_cores(), _quota())))


def use_threads(count: int | None) -> None:
    """Choose how many threads kernels use in this process, at most as many as are available.

    Args:
        count: Threads. None: one for what is made while it is shown, every available one for all else.
    """
    global _chosen
    _chosen = None if count is None else max(1, min(count, available()))


def threads() -> int:
    """Threads that kernels use now, when they are called from this thread."""
    most = available() if _chosen is None else _chosen
    return min(most, getattr(_here, "most", most))


@contextmanager
def at_most(count: int) -> Iterator[None]:
    """Within the block, kernels that this thread calls use no more threads than `count`."""
    before = getattr(_here, "most", None)
    _here.most = count if before is None else min(before, count)
    try:
        yield
    finally:
        if before is None:
            del _here.most
        else:
            _here.most = before


@contextmanager
def real_time_threads() -> Iterator[None]:
    """Within the block, kernels use one thread, unless another number was chosen by `use_threads`."""
    with at_most(1 if _chosen is None else _chosen):
        yield


def call_parallel(function: Any, arguments: tuple[Any, ...]) -> Any:
    """Call a kernel with a parallel loop on as many threads as `threads()` says and other programs leave cores for.

    Numba's own pool of threads, which serves where neither OpenMP nor TBB is found, ends the process when two threads
    enter it at once; there such calls wait for each other.
    """
    count = min(threads(), _other_work().free_cores())
    with _launching:
        _prepare(count)
        alone = _layer() == "workqueue"
    if not alone:
        return function(*arguments)
    with _one_at_a_time:
        return function(*arguments)


def _prepare(count: int) -> None:
    """Start numba's threads if they do not run yet, and tell them how many take part in calls of this thread."""
    if getattr(_here, "told", None) == count:
        return
    with _short_spins():
        numba.set_num_threads(count)
    _here.told = count


@contextmanager
def _short_spins() -> Iterator[None]:
    """Within the block, OpenMP is told to let waiting threads sleep soon, unless the environment says otherwise.

    OpenMP reads its environment once, when it is loaded.
    """
    name = "GOMP_SPINCOUNT"
    if name in os.environ or "OMP_WAIT_POLICY" in os.environ:
        yield
        return
    os.environ[name] = _SPINS
    try:
        yield
    finally:
        del os.environ[name]


@cache
def _other_work() -> OtherWork:
    return OtherWork(os.cpu_count() or 1)


@cache
def _layer() -> str:
    """Numba's threading layer: `omp`, `tbb` or `workqueue`; called when its threads run."""
    return threading_layer()


def _allowed_cores() -> int:
    """Cores that this process may run on."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _quota(root: Path = Path("/sys/fs/cgroup"), own: Path = Path("/proc/self/cgroup")) -> float:
    """Cores' worth of time that the container of this process has, infinite where it has no limit.

    Args:
        root: Where Linux shows its control groups.
        own: The file that says in which group this process is.
    """
    try:
        paths = [line.split(":", 2)[2] for line in own.read_text().splitlines() if line.startswith("0::")]
    except OSError:
        paths = []
    groups = {root} | {group for path in paths for group in _upward(root, root / path.strip("/"))}
    return min((_limit(group) for group in groups), default=math.inf)


def _upward(root: Path, group: Path) -> list[Path]:
    return [each for each in (group, *group.parents) if each == root or root in each.parents]


def _limit(group: Path) -> float:
    """Cores' worth of time of one control group, of version 2 or 1; infinite where it says nothing."""
    try:
        quota, period = (group / "cpu.max").read_text().split()
        return math.inf if quota == "max" else int(quota) / int(period)
    except (OSError, ValueError):
        pass
    try:
        quota = int((group / "cpu" / "cpu.cfs_quota_us").read_text())
        period = int((group / "cpu" / "cpu.cfs_period_us").read_text())
    except (OSError, ValueError):
        return math.inf
    return quota / period if quota > 0 and period > 0 else math.inf
