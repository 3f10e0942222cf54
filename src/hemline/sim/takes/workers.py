"""Who makes calls: one function for all that is shared out."""

from collections.abc import Iterator
from contextlib import contextmanager

from hemline.errors import BadInput

from .cluster import cluster
from .jobs import Workers
from .processes import Here, processes


@contextmanager
def workers(jobs: int = 1, scheduler: str | None = None) -> Iterator[Workers]:
    """This process, some beside it, or those of a dask scheduler; what they make does not depend on it.

    Args:
        jobs: Processes of this machine; 1 is this one.
        scheduler: Address of a dask scheduler, such as `tcp://host:8786`, whose workers do it instead.

    Raises:
        BadInput: Both are asked for.
        BadCluster: No scheduler answers, or its workers cannot run this hemline.
        MissingExtra: dask.distributed is not installed.
    """
    if scheduler is None:
        if jobs == 1:
            yield Here()
            return
        with processes(jobs) as beside:
            yield beside
        return
    if jobs != 1:
        raise BadInput("jobs are processes of this machine, a scheduler has workers of its own", "both", "give one")
    with cluster(scheduler) as far:
        yield far
