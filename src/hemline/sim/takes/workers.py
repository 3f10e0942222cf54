"""Chooses the workers for all work that is shared out."""

from collections.abc import Iterator
from contextlib import contextmanager

from hemline.errors import BadInput

from .cluster import cluster
from .jobs import Workers
from .processes import ThisProcess, processes


@contextmanager
def workers(jobs: int = 1, scheduler: str | None = None) -> Iterator[Workers]:
    """Yields what runs the calls: this process, child processes, or dask workers. Results do not depend on it.

    Args:
        jobs: Number of processes of this machine; 1 is this process.
        scheduler: Address of a dask scheduler whose workers make the calls instead, such as `tcp://host:8786`.

    Raises:
        BadInput: Both `jobs` and `scheduler` are given.
        BadCluster: No scheduler answers, or its workers cannot run this hemline.
        MissingExtra: dask.distributed is not installed.
    """
    if scheduler is None:
        if jobs == 1:
            yield ThisProcess()
            return
        with processes(jobs) as children:
            yield children
        return
    if jobs != 1:
        raise BadInput("jobs are processes of this machine, a scheduler has workers of its own", "both", "give one")
    with cluster(scheduler) as connected:
        yield connected
