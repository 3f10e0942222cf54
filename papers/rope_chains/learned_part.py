"""Times the learned part of the shipped cape: `NUMBA_NUM_THREADS=1 python -m papers.rope_chains.learned_part`.

Prints minimum and median of many repetitions with warm caches for the networks, the reconstruction, and both with the
key frame [ms].
"""

import argparse
import statistics
import time
from collections.abc import Callable

import numpy as np

import hemline
from hemline import bodies, motions


def measure(name: str, work: Callable[[], object], count: int = 500) -> None:
    work()
    spans = []
    for _ in range(count):
        began = time.perf_counter()
        work()
        spans.append(1e3 * (time.perf_counter() - began))
    print(f"{name:<16} min {min(spans):.3f}  median {statistics.median(spans):.3f} ms")


def main() -> None:
    argparse.ArgumentParser(description=__doc__).parse_args()
    model = hemline.load("cape")
    body = bodies.load(model.body_name).shaped()
    posed = body.posed(motions.load("walk")[0])
    state = model.start(posed)
    random, key = np.random.default_rng(1), posed.transforms[model.key]
    moved = (0.1 * random.normal(size=3 * model.ropes.node_count)).astype(np.float32)
    coefficients = random.normal(size=model.basis.mode_count).astype(np.float32)
    source, ropes = model.source, state.bones.ropes
    bones = ropes.positions
    measure("correction", lambda: source.correction(moved, source._body_inputs(ropes, ropes.frames, 1 / 60)))
    measure("two networks", lambda: (model.skinning(moved), model.shape(moved)))
    measure("reconstruction", lambda: model.basis.vertices(coefficients, model.rest, key))
    measure("learned part", lambda: model.step(state, posed, 1 / 60, bones=bones))
    measure("whole animator", lambda: model.step(state, posed, 1 / 60))


if __name__ == "__main__":
    main()
