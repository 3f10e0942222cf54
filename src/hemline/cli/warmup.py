"""`hemline warmup`."""

import multiprocessing
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

from .progress import note


@dataclass(frozen=True)
class Arguments:
    """Compile all kernels now."""

    jobs: int = 1
    """Processes that share the stages out."""


def run(arguments: Arguments) -> int:
    """Run each stage once, on what ships, so that numba compiles and caches it."""
    from hemline.compiled import cache_folder
    from hemline.errors import BadInput
    from hemline.playback.warmup import STAGES

    if arguments.jobs < 1:
        raise BadInput("--jobs must be at least 1", arguments.jobs, "give the number of cores")
    for name, seconds in zip(STAGES, _seconds(list(STAGES), arguments.jobs), strict=True):
        note(f"{name:<14}{seconds:6.1f} s")
    print(cache_folder())
    return 0


def _seconds(names: list[str], jobs: int) -> Iterator[float]:
    """How long each stage took, in order."""
    from hemline.playback.warmup import run_stage

    if jobs == 1:
        yield from map(run_stage, names)
        return
    with ProcessPoolExecutor(jobs, mp_context=multiprocessing.get_context("spawn")) as pool:
        try:
            yield from pool.map(run_stage, names)
        except BaseException:
            # a compiler does not hear Ctrl-C until it is done with a function, which may take a minute
            for process in list((pool._processes or {}).values()):
                process.terminate()
            pool.shutdown(wait=False, cancel_futures=True)
            raise
