"""`hemline warmup`."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from .progress import note

if TYPE_CHECKING:
    from collections.abc import Callable

    from hemline.sim.takes.jobs import Job, Tell


@dataclass(frozen=True)
class Arguments:
    """Compile all kernels now."""

    jobs: int = 1
    """Processes that share the stages out."""


def run(arguments: Arguments) -> int:
    """Run each stage once, on what ships, so that numba compiles it and it is kept on disk."""
    from hemline.compiled import cache_folder
    from hemline.errors import BadInput
    from hemline.playback.warmup import STAGES
    from hemline.sim.takes.jobs import run_jobs
    from hemline.sim.takes.workers import workers

    if arguments.jobs < 1:
        raise BadInput("--jobs must be at least 1", arguments.jobs, "give the number of cores")
    with workers(arguments.jobs) as those:
        run_jobs(map(_warmed, STAGES), those)
    print(cache_folder())
    return 0


def _warmed(stage: str) -> "Job[None]":
    """Have a stage run by a worker, and say how long it took."""
    from hemline.playback.warmup import run_stage
    from hemline.sim.takes.jobs import Call

    seconds = yield Call(_run, run_stage, stage)
    note(f"{stage:<24}{seconds:6.1f} s")


def _run(run_stage: "Callable[[str], float]", stage: str, tell: "Tell") -> float:
    from hemline.compiled import use_threads

    use_threads(None)  # for the loops on all threads, too
    return run_stage(stage)
