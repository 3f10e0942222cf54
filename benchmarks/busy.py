"""Measures playback and simulation on a busy machine: `python -m benchmarks.busy`.

Plays 90 frames of a walk by `live` with the light T-shirt and simulates 20 frames of a run, beside zero, one and two
programs that never rest, with one thread and with all. Prints a table with the median and the worst frame [ms] and the
time of the simulation [s].
"""

import argparse
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

import hemline
from hemline import sim
from hemline.bench.machine import commit, machine
from hemline.compiled import available, use_threads

FRAMES = 90
LOADS = (0, 1, 2)
LOOP = "while True: pass"


@contextmanager
def busy(count: int) -> Iterator[None]:
    """Runs programs that never rest while the block is executed."""
    loops = [subprocess.Popen([sys.executable, "-c", LOOP]) for _ in range(count)]
    try:
        yield
    finally:
        for loop in loops:
            loop.kill()
            loop.wait()


def main() -> None:
    """Measures and prints the table."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    body, walk = hemline.bodies.load("anny24").shaped(), hemline.motions.load("walk")
    shirt = hemline.load("live").animator_for(hemline.garments.load("tshirt-light"), body)
    print(f"{machine()}, commit {commit()}\n")
    print("| threads | programs beside | median ms | worst ms | simulation s |\n|---|---|---|---|---|")
    garment, run = hemline.garments.load("tshirt-light"), body.placed(hemline.motions.load("run").resample(30))[:20]
    rest = sim.rest_drape(garment, body, sim.SimSettings())
    for count in dict.fromkeys((1, available())):
        use_threads(count)
        list(hemline.play(shirt, body, walk[:3]))
        sim.simulate(garment, body, run[:2], sim.SimSettings(), start=rest)
        for beside in LOADS:
            with busy(beside):
                frames = hemline.play(shirt, body, walk[:FRAMES])
                times = [sum(frame.milliseconds.values()) for frame in frames]
                began = time.perf_counter()
                sim.simulate(garment, body, run, sim.SimSettings(), start=rest)
                spent = time.perf_counter() - began
            print(f"| {count} | {beside} | {np.median(times):.0f} | {max(times):.0f} | {spent:.1f} |", flush=True)


if __name__ == "__main__":
    main()
