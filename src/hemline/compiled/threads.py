"""The number of threads that kernels use.

Offline work (a simulation, a fit) uses every core that this process may use and that other programs leave free.
Real-time work uses one thread: threads that synchronise some thousand times a frame wait for the slowest of them, so on
a busy machine a frame would take many times as long.
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
"""Spins for which a thread of OpenMP waits awake; the default of 300,000 takes cores from other programs."""
_launching = threading.Lock()
_one_at_a_time = threading.RLock()


@cache
def available() -> int:
    """Returns the threads that kernels can use, as numba, the affinity of this process and its container allow."""
    return max(1, math.ceil(min(_config.NUMBA_NUM_THREADS, _affinity_cores(), _quota())))


def use_threads(count: int | None) -> None:
    """Sets how many threads kernels use in this process, at most as many as are available.

    Args:
        count: Number of threads. None: one for real-time work, all available ones for other work.
    """
    global _chosen
    _chosen = None if count is None else max(1, min(count, available()))


def threads() -> int:
    """Returns the number of threads that kernels use now, when called from this thread."""
    most = available() if _chosen is None else _chosen
    return min(most, getattr(_here, "most", most))


@contextmanager
def at_most(count: int) -> Iterator[None]:
    """Context manager in which kernels called by this thread use at most `count` threads."""
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
    """Context manager in which kernels use one thread, unless `use_threads` set another number."""
    with at_most(1 if _chosen is None else _chosen):
        yield


def call_parallel(function: Any, arguments: tuple[Any, ...]) -> Any:
    """Calls a kernel with a parallel loop on `threads()` threads, or fewer if other programs leave fewer cores free.

    Numba's own thread pool, used where neither OpenMP nor TBB is found, crashes the process if two threads enter it at
    once; with it, such calls wait for each other.
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
    """Starts numba's threads if they do not run yet, and sets how many take part in calls of this thread."""
    if getattr(_here, "count", None) == count:
        return
    with _short_spins():
        numba.set_num_threads(count)
    _here.count = count


@contextmanager
def _short_spins() -> Iterator[None]:
    """Context manager in which OpenMP loads with a short spin count, unless the environment sets its own.

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
    """Returns numba's threading layer, `omp`, `tbb` or `workqueue`; its threads must run."""
    return threading_layer()


def _affinity_cores() -> int:
    """Returns the number of cores that this process may run on."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _quota(root: Path = Path("/sys/fs/cgroup"), own: Path = Path("/proc/self/cgroup")) -> float:
    """Returns the CPU quota of this process's container in cores, infinite without a limit.

    Args:
        root: Folder in which Linux shows its control groups.
        own: File that names the group of this process.
    """
    try:
        paths = [line.split(":", 2)[2] for line in own.read_text().splitlines() if line.startswith("0::")]
    except OSError:
        paths = []
    groups = {root} | {group for path in paths for group in _upward(root, root / path.strip("/"))}
    return min((_limit(group) for group in groups), default=math.inf)


def _upward(root: Path, group: Path) -> list[Path]:
    """Returns a group and its ancestors up to the root."""
    return [each for each in (group, *group.parents) if each == root or root in each.parents]


def _limit(group: Path) -> float:
    """Returns the CPU quota of one control group (version 2 or 1) in cores, infinite without a limit."""
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
