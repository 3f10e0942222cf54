"""Calls made by the workers of a dask scheduler, on however many machines.

Workers get a setup once and an argument with each call, and send back what came of it: they need no disk that this
process sees. A call whose worker dies is made again by another one, by the scheduler itself.
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
"""How long a scheduler is waited for [s]."""
CALLS_PER_WORKER = 2
"""Calls a worker: one that it makes, one that waits for it."""
MIN_CALLS = 16
"""Calls that are sent however few workers there are, so that a cluster that grows with its work sees some."""
PROGRESS_INTERVAL = 1.0
"""A worker tells how far a call is no more often than this [s]."""
RETRY_CURE = "run the same command again: what is done is kept"


@functools.cache
def code() -> str:
    """What must be the same on all machines for the same bytes: our version and source, NumPy, numba."""
    import numba
    import numpy as np

    from hemline.version import VERSION

    package, digest = Path(__file__).parents[2], hashlib.sha256()
    for file in sorted(package.rglob("*.py")):
        digest.update(str(file.relative_to(package)).encode() + file.read_bytes())
    return f"hemline {VERSION} (source {digest.hexdigest()[:8]}), numpy {np.__version__}, numba {numba.__version__}"


class Cluster:
    """Calls are made by the workers of a scheduler."""

    def __init__(self, client: Any, address: str):
        self._client, self._address = client, address
        self._pool = client.get_executor(pure=False)
        self._topic = f"hemline-{uuid.uuid4().hex}"
        self._told: deque[tuple[int, int, int]] = deque()
        self._heard: dict[int, Progress] = {}
        self._setups: WeakKeyDictionary[Any, Any] = WeakKeyDictionary()
        self._sent, self._slots, self._counted = 0, MIN_CALLS, -float("inf")
        client.subscribe_topic(self._topic, lambda event: self._told.append(tuple(event[1])))

    @property
    def slots(self) -> int:
        """Some more than there are workers, who may come and go."""
        if time.monotonic() - self._counted > 2.0:
            self._counted = time.monotonic()
            with self._said():
                self._slots = max(MIN_CALLS, CALLS_PER_WORKER * len(self._client.nthreads()))
        return self._slots

    def submit(self, call: Call) -> "Future[Any]":
        """Send it to the scheduler."""
        from distributed.protocol.pickle import dumps

        def called(*given: Any) -> Any:  # sent as it is, so that a worker without hemline can say so
            from .cluster import answer_call

            return answer_call(*given)

        self._sent += 1
        self._heard[number := self._sent] = call.heard
        with self._said():
            if call.setup not in self._setups:
                # a task, which is done again where its worker dies, and not scattered data, which would be lost
                self._setups[call.setup] = self._client.submit(bytes, dumps(call.setup), pure=False)
            setup = self._setups[call.setup]
            given = (code(), self._topic, number, setup.key, setup, dumps((call.work, call.argument)))
            future = self._pool.submit(called, *given, key=f"{call.work.__name__}-{uuid.uuid4().hex}")
        answer: Future[Any] = Future()
        future.add_done_callback(lambda made: self._passed_on(made, number, answer))
        return answer

    def finished(self, under_way: "Collection[Future[Any]]") -> "Iterable[Future[Any]]":
        """Those that are done; see `Workers`."""
        done = wait(under_way, timeout=0.1, return_when=FIRST_COMPLETED).done
        while self._told:
            number, steps, total = self._told.popleft()
            self._heard.get(number, ignore_progress)(steps, total)
        return done

    def check(self) -> None:
        """Refuse workers that would make other bytes, or none.

        Raises:
            BadCluster: A worker has no hemline or another one, or more than one thread.
        """

        def own(dask_worker: Any) -> tuple[str, int]:  # sent as it is, so that it runs where there is no hemline
            try:
                from .cluster import code
            except ImportError:
                return "no hemline of this version", 1
            return code(), dask_worker.state.nthreads

        with self._said():
            answers = self._client.run(own, on_error="return")
        for worker, answer in sorted(answers.items()):
            if isinstance(answer, BaseException):
                raise BadCluster(f"worker {worker} did not say which hemline it has", repr(answer), _same())
            _check(worker, *answer)
        if not answers:
            what = f"the scheduler at {self._address} has no worker"
            warnings.warn(HemlineWarning(what, "none so far", "this goes on when one comes"), stacklevel=3)

    def _passed_on(self, made: "Future[Any]", number: int, answer: "Future[Any]") -> None:
        """What came of a call, with what went wrong on the way in our words."""
        self._heard.pop(number, None)
        try:
            answer.set_result(made.result())
        except BaseException as error:
            answer.set_exception(self._in_our_words(error))

    def _in_our_words(self, error: BaseException) -> BaseException:
        from concurrent.futures import CancelledError

        from distributed import KilledWorker
        from distributed.comm.core import CommClosedError

        if isinstance(error, KilledWorker):
            what, cure = "a call was given up by the scheduler", "give workers more memory, or run the command again"
            return BadCluster(what, f"workers that died of it: {error.last_worker.address} the last", cure)
        if isinstance(error, ImportError | AttributeError):
            return BadCluster("a worker has no hemline, or another one", error, _same())
        if isinstance(error, CancelledError | CommClosedError | OSError) or self._client.status != "running":
            return BadCluster(f"the scheduler at {self._address} went away", type(error).__name__, RETRY_CURE)
        return error

    @contextmanager
    def _said(self) -> Iterator[None]:
        try:
            yield
        except BadCluster:
            raise
        except Exception as error:
            raise self._in_our_words(error) from error


@contextmanager
def cluster(address: str) -> Iterator[Cluster]:
    """The workers of a scheduler; at the end of the block it forgets what was not done.

    Args:
        address: Such as `tcp://host:8786`; it is waited for `CONNECT_TIMEOUT` long.

    Raises:
        BadCluster: None answers there, or its workers cannot run this hemline.
        MissingExtra: dask.distributed is not installed.
    """
    try:
        from distributed import Client
    except ImportError as reason:
        raise MissingExtra("distributed", "cluster", "sharing work out over a cluster") from reason
    # what goes wrong is said by us, in a line
    for name in ("distributed", "tornado.application", "asyncio"):
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    try:
        client = Client(address, timeout=CONNECT_TIMEOUT, set_as_default=False)
    except (OSError, ValueError, TypeError) as reason:
        what = f"no dask scheduler answers at {address}"
        cure = "start one with 'dask scheduler' and name it as tcp://HOST:8786"
        raise BadCluster(what, f"nothing within {CONNECT_TIMEOUT:g} s", cure) from reason
    try:
        found = Cluster(client, address)
        found.check()
        yield found
    finally:
        with suppress(Exception):
            client.close(timeout=2)


def _same() -> str:
    return f"install {code()} there, as here"


def _check(worker: str, there: str, threads: int) -> None:
    if there != code():
        raise BadCluster(f"worker {worker} cannot run this hemline", there, _same())
    if threads != 1:
        cure = "start it with 'dask worker --nthreads 1 --nworkers CORES'"
        raise BadCluster(f"worker {worker} must have one thread: a take is simulated by one", threads, cure)


def answer_call(there: str, topic: str, number: int, key: str, setup: bytes, asked: bytes) -> Any:
    """Make one call, on a worker; one that came late was not asked before which hemline it has.

    Args:
        there: The `code` of who asks.
        topic: Where it listens.
        number: The call.
        key: Of the setup.
        setup: What the call has in common with others, serialised.
        asked: Function and argument, serialised.

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

    work, argument = loads(asked)
    return work(cached_setup(key, lambda: loads(setup)), argument, tell)
