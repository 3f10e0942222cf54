"""Work as jobs: generators that stay in this process and yield calls, which workers do wherever they are.

A job looks up what a dataset has, yields a `Call` for what is missing, is given back what came of it, and writes that.
So one process alone touches the dataset, workers share no disk with it, and what a worker was at when it was killed is
a call that can be made again, anywhere, to the same result.
"""

from collections import OrderedDict
from collections.abc import Callable, Collection, Generator, Iterable
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar, runtime_checkable

Result = TypeVar("Result")
Report = Callable[[str, int, int], None]
"""Called with what is worked on, the steps done and the steps in all."""
Progress = Callable[[int, int], None]
"""Called with the steps done and the steps in all."""


MAX_CACHED_SETUPS = 4
"""Setups that a worker keeps."""
_setups: OrderedDict[Any, Any] = OrderedDict()


def cached_setup(key: Any, received: Callable[[], Any]) -> Any:
    """The setup of that key as it came first to this worker: what is prepared for it is kept with it."""
    if key not in _setups:
        _setups[key] = received()
    _setups.move_to_end(key)
    while len(_setups) > MAX_CACHED_SETUPS:
        _setups.popitem(last=False)
    return _setups[key]


def ignore_progress(done: int, total: int) -> None:
    """Where nobody wants to know."""


@dataclass(frozen=True, eq=False)
class Call:
    """One piece of work, of seconds to minutes, that depends on what is in it and on nothing else."""

    work: Callable[[Any, Any, Progress], Any]
    """A function of a module: given setup, argument and whom to tell."""
    setup: Any
    """What many calls have in common, the same object in all of them; a worker gets it once and keeps it."""
    argument: Any
    """What is its own."""
    heard: Progress = ignore_progress
    """Called in this process with what the work tells."""


Job = Generator[Call, Any, Result]


@runtime_checkable
class Workers(Protocol):
    """What makes calls: this process, processes beside it, or a cluster."""

    @property
    def slots(self) -> int:
        """Calls that should be under way, so that no worker waits for the next."""
        ...

    def submit(self, call: Call) -> "Future[Any]":
        """Have a call made."""
        ...

    def finished(self, under_way: "Collection[Future[Any]]") -> "Iterable[Future[Any]]":
        """Those that are done, after a tenth of a second's wait; what workers told meanwhile is passed on."""
        ...


def run_jobs(jobs: Iterable[Job[Result]], workers: Workers) -> list[Result]:
    """Run jobs to their ends, as many at a time as keep the workers busy, the first ones first.

    Args:
        jobs: The jobs; the next one is begun when there is a slot for it.
        workers: What makes their calls.

    Returns:
        What each job returned, in order.

    Raises:
        Exception: What a call raised and its job let pass; calls that are under way are given up.
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
        for done in workers.finished(under_way):
            number, job = under_way.pop(done)
            advance(number, job, lambda job=job, done=done: _resume(job, done))


def _resume(job: Job[Result], done: "Future[Any]") -> Call:
    error = done.exception()
    return job.send(done.result()) if error is None else job.throw(error)
