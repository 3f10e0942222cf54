"""Calls made in this process, or in processes beside it, which end when their parent is killed."""

import itertools
import os
import threading
import time
from collections.abc import Collection, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from contextlib import contextmanager
from multiprocessing import get_context
from typing import Any
from weakref import WeakKeyDictionary

from hemline.compiled import available

from .jobs import Call, Progress, cached_setup, ignore_progress


class Here:
    """Calls are made in this process, one after the other."""

    slots = 1

    def submit(self, call: Call) -> "Future[Any]":
        """Make it now."""
        future: Future[Any] = Future()
        try:
            future.set_result(call.work(call.setup, call.argument, call.heard))
        except Exception as error:
            future.set_exception(error)
        return future

    def finished(self, under_way: "Collection[Future[Any]]") -> "Iterable[Future[Any]]":
        """All of them."""
        return list(under_way)


class Processes:
    """Calls are made in processes of this machine."""

    def __init__(self, pool: ProcessPoolExecutor, slots: int, progress: Any):
        self.slots, self._pool, self._progress = slots, pool, progress
        self._heard: dict[int, Progress] = {}
        self._setups: WeakKeyDictionary[Any, int] = WeakKeyDictionary()
        self._numbers = itertools.count()

    def submit(self, call: Call) -> "Future[Any]":
        """Send it to the next free process."""
        number, setup = next(self._numbers), self._setups.setdefault(call.setup, next(self._numbers))
        self._heard[number] = call.heard
        future = self._pool.submit(_run_call, number, call.work, setup, call.setup, call.argument)
        future.add_done_callback(lambda _: self._heard.pop(number))
        return future

    def finished(self, under_way: "Collection[Future[Any]]") -> "Iterable[Future[Any]]":
        """Those that are done; see `Workers`."""
        done = wait(under_way, timeout=0.1, return_when=FIRST_COMPLETED).done
        while not self._progress.empty():
            number, steps, total = self._progress.get()
            self._heard.get(number, ignore_progress)(steps, total)
        return done


@contextmanager
def processes(jobs: int) -> Iterator[Processes]:
    """So many processes; they end with the block."""
    # numba's threads and fork do not mix: spawn
    context = get_context("spawn")
    progress = context.SimpleQueue()
    threads = max(1, available() // jobs)
    with ProcessPoolExecutor(jobs, context, _start_worker, (os.getpid(), threads, progress)) as pool:
        try:
            yield Processes(pool, jobs, progress)
        except BaseException:
            # they are ended, not asked: a compiler does not hear Ctrl-C before it is done with a function
            for process in list((pool._processes or {}).values()):
                process.terminate()
            # waited for, which takes a moment now: a pool that is let go while its own thread still clears up after
            # broken processes may wait for itself for ever (CPython 3.13.0, seen after Ctrl-C)
            pool.shutdown(wait=True, cancel_futures=True)
            raise


_progress: Any = None


def _start_worker(parent: int, threads: int, progress: Any) -> None:
    """Set a worker's threads, and end it when its parent was killed."""
    global _progress
    _progress = progress
    from hemline.compiled import use_threads

    use_threads(threads)

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.5)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _run_call(number: int, work: Any, key: int, setup: Any, argument: Any) -> Any:
    last = 0.0

    def tell(done: int, total: int) -> None:
        nonlocal last
        if done == total or time.monotonic() - last > 0.2:
            last = time.monotonic()
            _progress.put((number, done, total))

    return work(cached_setup(key, lambda: setup), argument, tell)
