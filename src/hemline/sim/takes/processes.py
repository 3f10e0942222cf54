"""Work shared out over processes, which end when their parent is killed."""

import os
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from multiprocessing import get_context
from typing import Any, TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")
Report = Callable[[str, int, int], None]
"""Called with what is worked on, the steps done and the steps in all."""


def in_processes(
    work: Callable[[Item, Report], Result], items: Sequence[Item], jobs: int, report: Report
) -> list[Result]:
    """Do a piece of work for each item, so many at a time; with one job in this process.

    Args:
        work: A function of a module, given an item and whom to report to.
        items: What can be sent to another process.
        jobs: Processes.
        report: Called in this process, about ten times a second of waiting.

    Returns:
        One result an item, in order.
    """
    if jobs == 1:
        return [work(item, report) for item in items]
    # numba's threads and fork do not mix: spawn
    context = get_context("spawn")
    progress = context.SimpleQueue()
    threads = max(1, (os.cpu_count() or 1) // jobs)
    with ProcessPoolExecutor(jobs, context, _start_worker, (os.getpid(), threads, progress)) as pool:
        futures: list[Future[Result]] = [pool.submit(_call, work, item) for item in items]
        try:
            pending = set(futures)
            while pending:
                pending = wait(pending, timeout=0.1, return_when=FIRST_COMPLETED).not_done
                while not progress.empty():
                    report(*progress.get())
            return [future.result() for future in futures]
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            for process in list(getattr(pool, "_processes", None) or {}):
                os.kill(process, 15)
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


def _call(work: Callable[[Item, Report], Result], item: Item) -> Result:
    last = 0.0

    def tell(name: str, done: int, total: int) -> None:
        nonlocal last
        if done == total or time.monotonic() - last > 0.2:
            last = time.monotonic()
            _progress.put((name, done, total))

    return work(item, tell)
