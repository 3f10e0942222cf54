"""Jobs: generators that run in this process and yield calls, which workers make anywhere.

A job looks up what a dataset holds, yields a `Call` for what is missing, receives the result and writes it. So only one
process touches the dataset, and workers need no shared disk. A call whose worker was killed can be made again,
anywhere, with the same result.
"""

from collections import OrderedDict
from collections.abc import Callable, Collection, Generator, Iterable
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar, runtime_checkable

Result = TypeVar("Result")
Report = Callable[[str, int, int], None]
"""Called with the name of the work, the steps done and the total number of steps."""
Progress = Callable[[int, int], None]
"""Called with the steps done and the total number of steps."""


MAX_CACHED_SETUPS = 4
"""Number of setups that a worker caches."""
_setups: OrderedDict[Any, Any] = OrderedDict()


def cached_setup(key: Any, load: Callable[[], Any]) -> Any:
    """Returns the setup of a key as this worker first received it, together with everything prepared for it."""
    if key not in _setups:
        _setups[key] = load()
    _setups.move_to_end(key)
    while len(_setups) > MAX_CACHED_SETUPS:
        _setups.popitem(last=False)
    return _setups[key]


def ignore_progress(done: int, total: int) -> None:
    """Ignores progress."""


@dataclass(frozen=True, eq=False)
class Call:
    """One piece of work, of seconds to minutes, that depends only on its own fields."""

    work: Callable[[Any, Any, Progress], Any]
    """Function of a module that takes the setup, the argument and a progress callback."""
    setup: Any
    """Setup that many calls share, the same object in all of them; a worker receives it once and caches it."""
    argument: Any
    """Argument of this call."""
    on_progress: Progress = ignore_progress
    """Called in this process with the progress of the work."""


Job = Generator[Call, Any, Result]


@runtime_checkable
class Workers(Protocol):
    """The makers of calls: this process, other processes, or a cluster."""

    @property
    def slots(self) -> int:
        """Number of calls that should be under way so that no worker waits for the next."""
        ...

    def submit(self, call: Call) -> "Future[Any]":
        """Submits a call."""
        ...

    def poll(self, under_way: "Collection[Future[Any]]") -> "Iterable[Future[Any]]":
        """Waits up to a tenth of a second, passes on the progress of calls, and returns the calls that are done."""
        ...


def run_jobs(jobs: Iterable[Job[Result]], workers: Workers) -> list[Result]:
    """Runs jobs to their ends, as many at a time as keep the workers busy, the first ones first.

    Args:
        jobs: The jobs; the next one begins when there is a free slot.
        workers: The makers of their calls.

    Returns:
        The result of each job, in order.

    Raises:
        Exception: A call raised an error that its job did not handle; calls under way are abandoned.
    """
    results: dict[int, Result] = {}
    under_way: dict[Future[Any], tuple[int, Job[Result]]] = {}
    upcoming = enumerate(jobs)

    def advance(number: int, job: Job[Result], step: Callable[[], Call]) -> None:
        try:
            call = step()
        except StopIteration as end:
            results[number] = end.value
        else:
            under_way[workers.submit(call)] = number, job

    while True:
        while len(under_way) < workers.slots:
            following = next(upcoming, None)
            if following is None:
                break
            number, job = following
            advance(number, job, lambda job=job: next(job))
        if not under_way:
            return [results[number] for number in sorted(results)]
        for done in workers.poll(under_way):
            number, job = under_way.pop(done)
            advance(number, job, lambda job=job, done=done: _resume(job, done))


def _resume(job: Job[Result], done: "Future[Any]") -> Call:
    """Resumes a job with the result or the error of its call; returns the next call."""
    error = done.exception()
    return job.send(done.result()) if error is None else job.throw(error)
