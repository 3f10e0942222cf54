"""A dask scheduler and workers of one thread, as processes of this machine."""

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


class DaskCluster:
    """Processes that end with the block that made them."""

    def __init__(self, folder: Path):
        self.folder, self.processes = folder, []
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        self.address = f"tcp://127.0.0.1:{port}"
        words = ["distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", str(port), "--no-dashboard"]
        self.scheduler = self._start(words, os.pathsep.join(sys.path))
        deadline = time.monotonic() + 60
        while time.monotonic() < deadline:
            with socket.socket() as tried:
                if tried.connect_ex(("127.0.0.1", port)) == 0:
                    return
            time.sleep(0.1)
        raise TimeoutError(f"no scheduler: {self.said()}")

    def add_worker(self, path: str | None = None, threads: int = 1) -> None:
        """One more; `path` is where it looks for modules first."""
        words = ["distributed.cli.dask_worker", self.address, "--nthreads", str(threads), "--no-nanny"]
        words += ["--no-dashboard", "--local-directory", str(self.folder), "--death-timeout", "60"]
        self._start(words, os.pathsep.join([*([path] if path else []), *sys.path]))

    def wait_for(self, count: int) -> None:
        """Until so many workers are there."""
        code = f"from distributed import Client; Client({self.address!r}).wait_for_workers({count}, timeout=60)"
        subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)

    def said(self) -> str:
        """What the processes have written."""
        return "\n".join(file.read_text() for file in sorted(self.folder.glob("*.log")))

    def end(self) -> None:
        """Kill them all."""
        for process in self.processes:
            process.send_signal(signal.SIGKILL)
        for process in self.processes:
            process.wait()

    def _start(self, words: list[str], path: str) -> subprocess.Popen:
        alone = {"OMP_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1", "PYTHONPATH": path}
        with (self.folder / f"{len(self.processes)}.log").open("wb") as log:
            command = [sys.executable, "-m", *words]
            process = subprocess.Popen(command, stdout=log, stderr=log, env=os.environ | alone)
        self.processes.append(process)
        return process


@contextmanager
def dask_cluster(folder: Path, workers: int) -> Iterator[DaskCluster]:
    """A scheduler and so many workers."""
    folder.mkdir()
    found = DaskCluster(folder)
    try:
        for _ in range(workers):
            found.add_worker()
        if workers:
            found.wait_for(workers)
        yield found
    finally:
        found.end()
