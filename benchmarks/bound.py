"""Compares the solver with the memory bandwidth: `python -m benchmarks.bound`.

A linear system of the cape (12,690 vertices) and of the light cape is captured in a step and solved repeatedly. The
time of an iteration of conjugate gradients is compared with the time of a plain sum over as many bytes, on as many
threads. Writes one JSON line per garment and number of threads to benchmarks/results/bound.jsonl.
"""

import argparse
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numba import njit, prange

from hemline import bodies, garments, motions, sim
from hemline.bench.body import milliseconds
from hemline.bench.machine import commit, machine
from hemline.compiled import threads as available
from hemline.compiled import use_threads
from hemline.sim.solver import system as solving
from hemline.sim.solver.conjugate_kernels import solve_band
from hemline.sim.solver.layout import Pattern

RESULTS = Path(__file__).parent / "results" / "bound.jsonl"
REPEATS, ITERATIONS = 15, 100
PATTERN, BAND, TOLERANCE, MAX_ITERATIONS = 0, 2, 4, 5
"""Indices of arguments of the solver."""


class CapturedSolve(Exception):
    """Carries the arguments of a solve out of a simulation."""


def system(name: str) -> tuple[tuple, Pattern]:
    """Returns copies of the arguments of the first solve of a falling garment, and its pattern."""
    garment = garments.load(name)
    shaped = bodies.load(garment.body_name).shaped()
    solve = solving.conjugate_gradients

    def catch(*arguments):
        raise CapturedSolve(tuple(map(copy_argument, arguments)))

    solving.conjugate_gradients = catch
    try:
        motion = shaped.placed(motions.load("run"))[:1]
        sim.simulate(garment, shaped, motion, sim.SimSettings(self_contact=False))
    except CapturedSolve as caught:
        return caught.args[0], caught.args[0][PATTERN]
    finally:
        solving.conjugate_gradients = solve
    raise RuntimeError("no step was taken")


def copy_argument(value):
    """Copies an argument of the solver with all of its arrays."""
    if isinstance(value, tuple):
        return type(value)(*map(copy_argument, value))
    return value.copy() if isinstance(value, np.ndarray) else value


def bytes_of(pattern: Pattern) -> int:
    """Returns the bytes that an iteration works on: matrix, preconditioner and four vectors, each counted once."""
    slots, ring, far = len(pattern.vertex), len(pattern.ring), len(pattern.far)
    return 40 * ring + 8 * far + 72 * slots + 4 * 16 * slots


@njit(parallel=True, fastmath=True)
def read(values, sums):
    # four independent sums, so that no addition waits for the one before
    for part in prange(sums.shape[0]):
        a, b, c, d = values[part, 0], values[part, 1], values[part, 2], values[part, 3]
        one = two = three = four = np.float32(0)
        for k in range(256):
            one += a[k]
            two += b[k]
            three += c[k]
            four += d[k]
        sums[part] = one + two + three + four


def seconds(work: Callable[[], object]) -> float:
    """Returns the median time of one of ITERATIONS repetitions of some work [s]."""
    return milliseconds(work, REPEATS)[1] / 1000 / ITERATIONS


def row(name: str, threads: int) -> dict:
    arguments, pattern = system(name)
    use_threads(threads)
    solve = [*arguments]
    solve[TOLERANCE], solve[MAX_ITERATIONS] = 1e-30, ITERATIONS
    took = seconds(lambda: solving.conjugate_gradients(*solve))
    size = bytes_of(pattern)
    values = np.zeros((size // 4096, 4, 256), np.float32)
    sums = np.zeros(len(values), np.float32)
    plain = seconds(lambda: [read(values, sums) for _ in range(ITERATIONS)])
    band, right = arguments[BAND], np.ones(len(arguments[BAND]))
    coarse = seconds(lambda: [solve_band(band, right.copy()) for _ in range(ITERATIONS)])
    return {
        "garment": name,
        "vertices": len(pattern.slot),
        "threads": threads,
        "iteration_us": round(1e6 * took, 1),
        "mbytes": round(size / 1e6, 2),
        "gbytes_s": round(size / took / 1e9, 1),
        "plain_read_us": round(1e6 * plain, 1),
        "plain_read_gbytes_s": round(size / plain / 1e9, 1),
        "share_of_bound": round(plain / took, 2),
        "coarse_solve_us": round(1e6 * coarse, 1),
    }


def main() -> None:
    argparse.ArgumentParser(description=__doc__).parse_args()
    with RESULTS.open("w") as stream:
        for name in ("cape-light", "cape"):
            for threads in range(1, available() + 1):
                line = row(name, threads)
                print(json.dumps(line), flush=True)
                stream.write(json.dumps(line | {"machine": machine(), "commit": commit()}) + "\n")


if __name__ == "__main__":
    main()
