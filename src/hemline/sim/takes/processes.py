"""Calls made in this process, or in child processes, which end when their parent is killed."""

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


class ThisProcess:
    """Makes calls in this process, one after the other."""

    slots = 1

    def submit(self, call: Call) -> "Future[Any]":
        """Makes a call at once."""
        future: Future[Any] = Future()
        try:
            future.set_result(call.work(call.setup, call.argument, call.on_progress))
        except Exception as error:
            future.set_exception(error)
        return future

    def poll(self, under_way: "Collection[Future[Any]]") -> "Iterable[Future[Any]]":
        """Returns all calls."""
        return list(under_way)


class Processes:
    """Makes calls in processes of this machine."""

    def __init__(self, pool: ProcessPoolExecutor, slots: int, progress: Any):
        self.slots, self._pool, self._progress = slots, pool, progress
        self._callbacks: dict[int, Progress] = {}
        self._setups: WeakKeyDictionary[Any, int] = WeakKeyDictionary()
        self._numbers = itertools.count()

    def submit(self, call: Call) -> "Future[Any]":
        """Sends a call to the next free process."""
        number, setup = next(self._numbers), self._setups.setdefault(call.setup, next(self._numbers))
        self._callbacks[number] = call.on_progress
        future = self._pool.submit(_run_call, number, call.work, setup, call.setup, call.argument)
        future.add_done_callback(lambda _: self._callbacks.pop(number))
        return future

    def poll(self, under_way: "Collection[Future[Any]]") -> "Iterable[Future[Any]]":
        """Returns the calls that are done, see `Workers.poll`."""
        done = wait(under_way, timeout=0.1, return_when=FIRST_COMPLETED).done
        while not self._progress.empty():
            number, steps, total = self._progress.get()
            self._callbacks.get(number, ignore_progress)(steps, total)
        return done


@contextmanager
def processes(jobs: int) -> Iterator[Processes]:
    """Starts processes that make calls; they end with the block."""
    # numba's threads and fork do not mix: spawn
    context = get_context("spawn")
    progress = context.SimpleQueue()
    threads = max(1, available() // jobs)
    with ProcessPoolExecutor(jobs, context, _start_worker, (os.getpid(), threads, progress)) as pool:
        try:
            yield Processes(pool, jobs, progress)
        except BaseException:
            # they are terminated, not asked to end: a compiler ignores Ctrl-C until it is done with a function
            for process in list((pool._processes or {}).values()):
                process.terminate()
            # waiting takes only a moment now, and a pool that is released while its own thread still cleans up after
            # broken processes may wait for itself for ever (CPython 3.13.0, observed after Ctrl-C)
            pool.shutdown(wait=True, cancel_futures=True)
            raise


_progress: Any = None


def _start_worker(parent: int, threads: int, progress: Any) -> None:
    """Sets a worker's threads, and ends it when its parent was killed."""
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
    """Makes a call in a child process."""
    last = 0.0

    def tell(done: int, total: int) -> None:
        nonlocal last
        if done == total or time.monotonic() - last > 0.2:
            last = time.monotonic()
            _progress.put((number, done, total))

    return work(cached_setup(key, lambda: setup), argument, tell)
