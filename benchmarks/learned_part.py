"""Time the learned part of the shipped cape: networks, reconstruction, both with the key frame.

Run `NUMBA_NUM_THREADS=1 python benchmarks/learned_part.py`: minima and medians of many repetitions, caches warm [ms].
"""

import statistics
import time
from collections.abc import Callable

import numpy as np

import hemline
from hemline import bodies, motions


def timed(name: str, work: Callable[[], object], count: int = 500) -> None:
    work()
    spans = []
    for _ in range(count):
        began = time.perf_counter()
        work()
        spans.append(1e3 * (time.perf_counter() - began))
    print(f"{name:<16} min {min(spans):.3f}  median {statistics.median(spans):.3f} ms")


def main() -> None:
    model = hemline.load("cape")
    body = bodies.load(model.body_name).shaped()
    posed = body.posed(motions.load("walk")[0])
    state = model.start(posed)
    random, key = np.random.default_rng(1), posed.transforms[model.key]
    moved = (0.1 * random.normal(size=3 * model.ropes.node_count)).astype(np.float32)
    coefficients = random.normal(size=model.basis.mode_count).astype(np.float32)
    bones = state.bones.ropes.positions
    timed("correction", lambda: model.correction(moved))
    timed("two networks", lambda: (model.skinning(moved), model.shape(moved)))
    timed("reconstruction", lambda: model.basis.vertices(coefficients, model.rest, key))
    timed("learned part", lambda: model.step(state, posed, 1 / 60, bones=bones))
    timed("whole animator", lambda: model.step(state, posed, 1 / 60))


if __name__ == "__main__":
    main()
