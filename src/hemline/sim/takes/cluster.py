"""Calls made by the workers of a dask scheduler, on any number of machines.

Workers receive a setup once and an argument with each call, and send back the result: they need no disk that this
process sees. If a worker dies, the scheduler itself has its call made again by another one.
"""

import functools
import hashlib
import logging
import time
import uuid
import warnings
from collections import deque
from collections.abc import Collection, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any
from weakref import WeakKeyDictionary

from hemline.errors import BadCluster, HemlineWarning, MissingExtra

from .jobs import Call, Progress, cached_setup, ignore_progress

CONNECT_TIMEOUT = 10.0
"""Maximum time to wait for a scheduler [s]."""
CALLS_PER_WORKER = 2
"""Calls per worker: one that it makes, one that waits for it."""
MIN_CALLS = 16
"""Minimum number of calls that are sent, so that a cluster that grows with its work sees some."""
PROGRESS_INTERVAL = 1.0
"""Minimum time between two progress reports of a call [s]."""
RETRY_CURE = "run the same command again: what is done is kept"


@functools.cache
def code() -> str:
    """Returns what must be the same on all machines for the same bytes: version and source of hemline, NumPy, numba."""
    import numba
    import numpy as np

    from hemline.version import VERSION

    package, digest = Path(__file__).parents[2], hashlib.sha256()
    for file in sorted(package.rglob("*.py")):
        digest.update(str(file.relative_to(package)).encode() + file.read_bytes())
    return f"hemline {VERSION} (source {digest.hexdigest()[:8]}), numpy {np.__version__}, numba {numba.__version__}"


class Cluster:
    """The workers of a scheduler."""

    def __init__(self, client: Any, address: str):
        self._client, self._address = client, address
        self._pool = client.get_executor(pure=False)
        self._topic = f"hemline-{uuid.uuid4().hex}"
        self._progress: deque[tuple[int, int, int]] = deque()
        self._callbacks: dict[int, Progress] = {}
        self._setups: WeakKeyDictionary[Any, Any] = WeakKeyDictionary()
        self._sent, self._slots, self._counted_at = 0, MIN_CALLS, -float("inf")
        client.subscribe_topic(self._topic, lambda event: self._progress.append(tuple(event[1])))

    @property
    def slots(self) -> int:
        """Somewhat more than the number of workers, which may come and go."""
        if time.monotonic() - self._counted_at > 2.0:
            self._counted_at = time.monotonic()
            with self._own_errors():
                self._slots = max(MIN_CALLS, CALLS_PER_WORKER * len(self._client.nthreads()))
        return self._slots

    def submit(self, call: Call) -> "Future[Any]":
        """Sends a call to the scheduler."""
        from distributed.protocol.pickle import dumps

        def call_worker(*inputs: Any) -> Any:  # sent by value, so that a worker without hemline can report that
            from .cluster import answer_call

            return answer_call(*inputs)

        self._sent += 1
        self._callbacks[number := self._sent] = call.on_progress
        with self._own_errors():
            if call.setup not in self._setups:
                # a task, which is repeated if its worker dies; scattered data would be lost
                self._setups[call.setup] = self._client.submit(bytes, dumps(call.setup), pure=False)
            setup = self._setups[call.setup]
            inputs = (code(), self._topic, number, setup.key, setup, dumps((call.work, call.argument)))
            future = self._pool.submit(call_worker, *inputs, key=f"{call.work.__name__}-{uuid.uuid4().hex}")
        answer: Future[Any] = Future()
        future.add_done_callback(lambda made: self._forward(made, number, answer))
        return answer

    def poll(self, under_way: "Collection[Future[Any]]") -> "Iterable[Future[Any]]":
        """Returns the calls that are done, see `Workers.poll`."""
        done = wait(under_way, timeout=0.1, return_when=FIRST_COMPLETED).done
        while self._progress:
            number, steps, total = self._progress.popleft()
            self._callbacks.get(number, ignore_progress)(steps, total)
        return done

    def check(self) -> None:
        """Checks that all workers make the same bytes as this process.

        Raises:
            BadCluster: A worker has no hemline or another one, or more than one thread.
        """

        def worker_code(dask_worker: Any) -> tuple[str, int]:  # sent by value, so that it runs without hemline
            try:
                from .cluster import code
            except ImportError:
                return "no hemline of this version", 1
            return code(), dask_worker.state.nthreads

        with self._own_errors():
            answers = self._client.run(worker_code, on_error="return")
        for worker, answer in sorted(answers.items()):
            if isinstance(answer, BaseException):
                raise BadCluster(f"worker {worker} did not say which hemline it has", repr(answer), _install_cure())
            _check(worker, *answer)
        if not answers:
            what = f"the scheduler at {self._address} has no worker"
            warnings.warn(HemlineWarning(what, "none so far", "this goes on when one comes"), stacklevel=3)

    def _forward(self, made: "Future[Any]", number: int, answer: "Future[Any]") -> None:
        """Passes on the result of a call; errors on the way become errors of hemline."""
        self._callbacks.pop(number, None)
        try:
            answer.set_result(made.result())
        except BaseException as error:
            answer.set_exception(self._own_error(error))

    def _own_error(self, error: BaseException) -> BaseException:
        """Returns the error of hemline for an error of dask or of a worker."""
        from concurrent.futures import CancelledError

        from distributed import KilledWorker
        from distributed.comm.core import CommClosedError

        if isinstance(error, KilledWorker):
            what, cure = "a call was given up by the scheduler", "give workers more memory, or run the command again"
            return BadCluster(what, f"workers that died of it: {error.last_worker.address} the last", cure)
        if isinstance(error, ImportError | AttributeError):
            return BadCluster("a worker has no hemline, or another one", error, _install_cure())
        if isinstance(error, CancelledError | CommClosedError | OSError) or self._client.status != "running":
            return BadCluster(f"the scheduler at {self._address} went away", type(error).__name__, RETRY_CURE)
        return error

    @contextmanager
    def _own_errors(self) -> Iterator[None]:
        """Turns errors of dask within the block into errors of hemline."""
        try:
            yield
        except BadCluster:
            raise
        except Exception as error:
            raise self._own_error(error) from error


@contextmanager
def cluster(address: str) -> Iterator[Cluster]:
    """Connects to the workers of a scheduler; at the end of the block the scheduler forgets calls that are not done.

    Args:
        address: Address such as `tcp://host:8786`; the connection is awaited for `CONNECT_TIMEOUT`.

    Raises:
        BadCluster: No scheduler answers there, or its workers cannot run this hemline.
        MissingExtra: dask.distributed is not installed.
    """
    try:
        from distributed import Client
    except ImportError as reason:
        raise MissingExtra("distributed", "cluster", "sharing work out over a cluster") from reason
    # errors are reported by hemline, in one line
    for name in ("distributed", "tornado.application", "asyncio"):
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    try:
        client = Client(address, timeout=CONNECT_TIMEOUT, set_as_default=False)
    except (OSError, ValueError, TypeError) as reason:
        what = f"no dask scheduler answers at {address}"
        cure = "start one with 'dask scheduler' and name it as tcp://HOST:8786"
        raise BadCluster(what, f"nothing within {CONNECT_TIMEOUT:g} s", cure) from reason
    try:
        connected = Cluster(client, address)
        connected.check()
        yield connected
    finally:
        with suppress(Exception):
            client.close(timeout=2)


def _install_cure() -> str:
    return f"install {code()} there, as here"


def _check(worker: str, there: str, threads: int) -> None:
    if there != code():
        raise BadCluster(f"worker {worker} cannot run this hemline", there, _install_cure())
    if threads != 1:
        cure = "start it with 'dask worker --nthreads 1 --nworkers CORES'"
        raise BadCluster(f"worker {worker} must have one thread: a take is simulated by one", threads, cure)


def answer_call(there: str, topic: str, number: int, key: str, setup: bytes, request: bytes) -> Any:
    """Makes one call, on a worker; a worker that came late is checked here.

    Args:
        there: The `code` of the process that asks.
        topic: Topic to which that process listens.
        number: Number of the call.
        key: Key of the setup.
        setup: The setup, serialised.
        request: Function and argument, serialised.

    Raises:
        BadCluster: This worker has another hemline, or more than one thread.
    """
    from distributed import get_worker
    from distributed.protocol.pickle import loads

    from hemline.compiled import use_threads

    worker = get_worker()
    if there != code():
        raise BadCluster(f"worker {worker.address} cannot run this hemline", code(), f"install {there} there, as here")
    _check(worker.address, code(), worker.state.nthreads)
    use_threads(1)
    last = 0.0

    def tell(done: int, total: int) -> None:
        nonlocal last
        if done == total or time.monotonic() - last > PROGRESS_INTERVAL:
            last = time.monotonic()
            worker.log_event(topic, [number, done, total])

    work, argument = loads(request)
    return work(cached_setup(key, lambda: loads(setup)), argument, tell)
