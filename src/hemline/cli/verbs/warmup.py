"""`hemline warmup`."""

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING

from hemline.cli.progress import bars, note

if TYPE_CHECKING:
    from collections.abc import Callable

    from hemline.sim.takes.jobs import Job, Progress


@dataclass(frozen=True)
class WarmupOptions:
    """Options of `hemline warmup`."""

    jobs: int = 1
    """Number of processes that compile in parallel."""
    json: bool = False
    """Print one JSON object with the folder of the compiled kernels, and the time of each part [s]."""


def run(options: WarmupOptions) -> int:
    """Runs each stage once on shipped models, so that numba compiles its kernels and caches them on disk."""
    from hemline.compiled import cache_folder
    from hemline.errors import BadInput
    from hemline.playback.warmup import STAGES, run_stage
    from hemline.sim.takes.jobs import Call, run_jobs
    from hemline.sim.takes.workers import workers

    if options.jobs < 1:
        raise BadInput("--jobs must be at least 1", options.jobs, "give the number of cores")
    seconds: dict[str, float] = {}
    with bars() as display, workers(options.jobs) as pool:
        task = display.add_task("compile", total=len(STAGES))

        def warm_up(stage: str) -> "Job[None]":
            seconds[stage] = yield Call(_run, run_stage, stage)
            display.advance(task)
            note(f"{stage:<24}{seconds[stage]:6.1f} s")

        run_jobs(map(warm_up, STAGES), pool)
    folder = str(cache_folder())
    print(json.dumps({"folder": folder, "seconds": seconds}) if options.json else folder)
    return 0


def _run(run_stage: "Callable[[str], float]", stage: str, progress: "Progress") -> float:
    from hemline.compiled import use_threads

    use_threads(None)  # parallel loops are compiled too
    return run_stage(stage)
