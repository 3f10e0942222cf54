"""Measures how fast SwinGar's network trains and plays on this machine: `python -m papers.swingar.throughput`.

Weights are random, and the garment is a sheet of 1,000 vertices. Times of one thread are CPU times, the least of some
runs, so that other work on the machine does not count. Those of more threads are wall times.
"""

import argparse
import os
import sys
import time
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import torch

from hemline.animators.swingar.estimator_config import EstimatorConfig
from hemline.animators.swingar.fit.estimator import Estimator, cost
from hemline.animators.swingar.fit.fit_graph import DISPLACEMENT_WIDTH
from hemline.animators.swingar.graph_inputs import STATE_FEATURES, VERTEX
from hemline.animators.swingar.runtime import RuntimeEstimator
from hemline.compiled import use_threads
from tests.animators.swingar.swingar_samples import graph_of, inputs

FRAMES = 10
FEATURES = {"told": VERTEX.count, "state_told": STATE_FEATURES, "displacement": DISPLACEMENT_WIDTH}
ENVIRONMENT = {
    "OPENBLAS_NUM_THREADS": "1",
    "MALLOC_MMAP_MAX_": "0",
    "MALLOC_TOP_PAD_": "500000000",
    "MALLOC_TRIM_THRESHOLD_": "100000000000",
}
"""One thread of BLAS, since waiting threads would count; and a glibc that keeps freed memory, since clearing pages of
new memory would count."""


def least(runs: int, clock: Callable[[], float], *steps: Callable[[], object]) -> list[float]:
    """Returns the least time of each of some consecutive steps [s]."""
    found = []
    for _ in range(runs):
        times = [clock()]
        for step in steps:
            step()
            times.append(clock())
        found.append([b - a for a, b in pairwise(times)])
    return np.min(found, axis=0).tolist()


def training(config: EstimatorConfig, rows: int, columns: int, runs: int) -> dict[str, float]:
    """Measures each part of the training [ms a frame] and both stages [frames/s]."""
    graph = graph_of(rows, columns)
    estimator = Estimator(config)
    t = {name: torch.from_numpy(each) for name, each in inputs(config, rows * columns, FRAMES).items()}
    kept = {}

    def encode():
        kept["garment"] = estimator.garment(graph, t["features"], t["descriptor"], t["skin_logits"])

    def coarse():
        kept["coarse"] = estimator.coarse(kept["garment"], t["motion"], t["transforms"], t["told"], t["turns"])[0]

    def still():
        with torch.no_grad():
            encode()

    def corrective():
        kept["corrective"] = estimator.corrective(kept["garment"], t["meshes"], t["joints"], t["body"])

    def back(name: str) -> Callable[[], object]:
        return lambda: (kept[name] - 1).square().mean().backward()

    steps = encode, coarse, back("coarse"), still, corrective, back("corrective")
    names = "garment", "coarse", "coarse, back", "-", "corrective", "corrective, back"
    found = {
        name: 1e3 * each / FRAMES for name, each in zip(names, least(runs, time.process_time, *steps), strict=True)
    }
    del found["-"]
    found["coarse frames/s"] = 1e3 / (found["garment"] + found["coarse"] + found["coarse, back"])
    found["corrective frames/s"] = 1e3 / (found["corrective"] + found["corrective, back"])
    return found


def playing(config: EstimatorConfig, rows: int, columns: int, runs: int, threads: int) -> dict[str, float]:
    """Measures the parts of a played frame [ms]."""
    use_threads(threads)
    graph, given = graph_of(rows, columns), inputs(config, rows * columns, 1)
    arrays = {name: each.detach().numpy() for name, each in Estimator(config).state_dict().items()}
    played = RuntimeEstimator.of(config, arrays, "float32")
    garment = played.garment(graph, given["features"], given["descriptor"], given["skin_logits"])
    clock = time.process_time if threads == 1 else time.perf_counter
    steps = (
        lambda: played.coarse(garment, given["motion"][0], given["transforms"][0], given["told"][0], given["turns"][0]),
        lambda: played.corrective(garment, given["meshes"][0], given["joints"][0], given["body"][0]),
    )
    coarse, corrective = (1e3 * each for each in least(runs, clock, *steps))
    return {"coarse": coarse, "corrective": corrective, "frame": coarse + corrective}


def main() -> None:
    """Prints all figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", type=int, default=25)
    parser.add_argument("--columns", type=int, default=40)
    parser.add_argument("--runs", type=int, default=6)
    options = parser.parse_args()
    torch.set_num_threads(1)
    for name, config in {"lean": EstimatorConfig.lean(**FEATURES), "full": EstimatorConfig(**FEATURES)}.items():
        count = options.rows * options.columns
        parts = cost(config, count)
        work = sum(flops for part, (_, flops) in parts.items() if part not in ("graph_first", "graph_second", "shape"))
        weights = sum(number for number, _ in parts.values())
        print(f"{name}: {weights:,} weights, {work / 1e9:.2f} GFLOP a frame of {count} vertices")
        print(
            "  weights; MFLOP: " + ", ".join(f"{part} {n:,}; {flops / 1e6:.0f}" for part, (n, flops) in parts.items())
        )
        use_threads(1)
        shown = training(config, options.rows, options.columns, options.runs)
        print("  training, ms a frame, one thread: " + ", ".join(f"{part} {each:.1f}" for part, each in shown.items()))
        for threads in sorted({1, os.cpu_count() or 1}):
            shown = playing(config, options.rows, options.columns, 3 * options.runs, threads)
            print(
                f"  playing, ms, threads {threads}: " + ", ".join(f"{part} {each:.1f}" for part, each in shown.items())
            )


if __name__ == "__main__":
    if any(name not in os.environ for name in ENVIRONMENT):
        command = [sys.executable, "-m", "papers.swingar.throughput", *sys.argv[1:]]
        os.execve(sys.executable, command, os.environ | ENVIRONMENT)
    main()
