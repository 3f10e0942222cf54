"""`hemline warmup`."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from hemline.cli.progress import note

if TYPE_CHECKING:
    from collections.abc import Callable

    from hemline.sim.takes.jobs import Job, Progress


@dataclass(frozen=True)
class WarmupOptions:
    """Options of `hemline warmup`."""

    jobs: int = 1
    """Number of processes that compile in parallel."""


def run(options: WarmupOptions) -> int:
    """Runs each stage once on shipped models, so that numba compiles its kernels and caches them on disk."""
    from hemline.compiled import cache_folder
    from hemline.errors import BadInput
    from hemline.playback.warmup import STAGES
    from hemline.sim.takes.jobs import run_jobs
    from hemline.sim.takes.workers import workers

    if options.jobs < 1:
        raise BadInput("--jobs must be at least 1", options.jobs, "give the number of cores")
    with workers(options.jobs) as pool:
        run_jobs(map(_warm_up, STAGES), pool)
    print(cache_folder())
    return 0


def _warm_up(stage: str) -> "Job[None]":
    """Runs a stage in a worker and prints how long it took."""
    from hemline.playback.warmup import run_stage
    from hemline.sim.takes.jobs import Call

    seconds = yield Call(_run, run_stage, stage)
    note(f"{stage:<24}{seconds:6.1f} s")


def _run(run_stage: "Callable[[str], float]", stage: str, progress: "Progress") -> float:
    from hemline.compiled import use_threads

    use_threads(None)  # parallel loops are compiled too
    return run_stage(stage)
