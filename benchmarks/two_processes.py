"""Measures the speed-up of a second process without a cluster: `python -m benchmarks.two_processes`.

It is a bound for `cluster.py`. Runs a call in one process and then in two at once, five times. The calls are
arithmetic in the interpreter, streaming through 160 MB, and a take of sixteen frames of the light cape.
"""

import argparse
import multiprocessing.pool
import os
import shutil
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from hemline import garments, motions
from hemline.sim import ClipRequest, SimSettings, produce

ROUNDS = 5
SETTINGS = SimSettings(lead_in=0.3)


def arithmetic(_: Path) -> float:
    """Returns the time of a loop that uses no memory [s]."""
    began, total = time.perf_counter(), 0
    for number in range(12_000_000):
        total += number * number
    return time.perf_counter() - began


def streaming(_: Path) -> float:
    """Returns the time of additions to an array larger than the caches [s]."""
    array = np.zeros(20_000_000)
    began = time.perf_counter()
    for _ in range(60):
        array += 1
    return time.perf_counter() - began


def simulating(settled: Path) -> float:
    """Returns the time of a take [s]."""
    run = ClipRequest(motions.load("run")[:16], motions.subject_of("run"))
    with tempfile.TemporaryDirectory() as scratch:
        shutil.copytree(settled, Path(scratch) / "takes")
        began = time.perf_counter()
        produce(Path(scratch) / "takes", garments.load("cape-light"), [run], settings=SETTINGS)
        return time.perf_counter() - began


def main() -> None:
    """Measures and prints."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        settled = Path(scratch) / "settled"
        produce(settled, garments.load("cape-light"), [], settings=SETTINGS)
        with multiprocessing.get_context("spawn").Pool(2) as pool:
            for call in (arithmetic, streaming, simulating):
                pool.map(call, [settled, settled], 1)  # loads code and kernels in both
                ratios = [_ratio(pool, call, settled) for _ in range(ROUNDS)]
                rounds = ", ".join(f"{each:.2f}" for each in ratios)
                print(
                    f"{call.__name__}: {statistics.median(ratios):.2f} times ({rounds}), load {os.getloadavg()[0]:.1f}"
                )


def _ratio(pool: multiprocessing.pool.Pool, call: Callable[[Path], float], settled: Path) -> float:
    (alone,) = pool.map(call, [settled], 1)
    return 2 * alone / max(pool.map(call, [settled, settled], 1))


if __name__ == "__main__":
    main()
