"""What bounds the simulator: `python -m benchmarks.bound`.

One system of conjugate gradients of the cape (12,690 vertices) and of the light one is caught in a step and solved
again and again; its bytes an iteration over its time is compared with the rate at which a plain sum reads as many
bytes from an array of that size, on as many threads. One JSON line each goes to benchmarks/results/bound.jsonl.
"""

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
PATTERN, BAND, TOLERANCE, MOST = 0, 2, 5, 6
"""Places of those among the arguments of the solver."""


class Caught(Exception):
    """The arguments of one solve."""


def system(name: str) -> tuple[tuple, Pattern]:
    """The arguments of the first solve of a garment that starts to fall, copied, and its pattern."""
    garment = garments.load(name)
    shaped = bodies.load(garment.body_name).shaped()
    solve = solving.conjugate_gradients

    def catch(*arguments):
        raise Caught(tuple(copied(each) for each in arguments))

    solving.conjugate_gradients = catch
    try:
        motion = shaped.placed(motions.load("run"))[:1]
        sim.simulate(garment, shaped, motion, sim.SimSettings(self_contact=False))
    except Caught as caught:
        return caught.args[0], Pattern(*caught.args[0][PATTERN])
    finally:
        solving.conjugate_gradients = solve
    raise RuntimeError("no step was taken")


def copied(value):
    """An argument of the solver, all of its arrays copied."""
    if isinstance(value, tuple):
        return tuple(copied(each) for each in value)
    return value.copy() if isinstance(value, np.ndarray) else value


def bytes_of(pattern: Pattern) -> int:
    """Bytes that an iteration works on: matrix, preconditioner, four vectors; each at least once."""
    slots, ring, far = len(pattern.vertex), len(pattern.ring), len(pattern.far)
    return 40 * ring + 8 * far + 72 * slots + 4 * 16 * slots


@njit(parallel=True, fastmath=True)
def read(values, sums):
    # four streams, so that no addition waits for the one before
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
    """Median time of a piece of work that is done ITERATIONS times over."""
    return milliseconds(work, REPEATS)[1] / 1000 / ITERATIONS


def row(name: str, threads: int) -> dict:
    arguments, pattern = system(name)
    use_threads(threads)
    solve = [*arguments]
    solve[TOLERANCE], solve[MOST] = 1e-30, ITERATIONS
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
    most = available()
    with RESULTS.open("w") as stream:
        for name in ("cape-light", "cape"):
            for threads in range(1, most + 1):
                line = row(name, threads)
                print(json.dumps(line), flush=True)
                stream.write(json.dumps(line | {"machine": machine(), "commit": commit()}) + "\n")


if __name__ == "__main__":
    main()
