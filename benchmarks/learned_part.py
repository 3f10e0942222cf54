"""Time the learned part of a cape of 12,690 vertices: networks, reconstruction, both with the key frame.

Run `NUMBA_NUM_THREADS=1 python benchmarks/learned_part.py`: minima and medians of many repetitions [ms]. Parameters are
drawn by chance; their values do not matter for the time.
"""

import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from hemline import bodies, garments
from hemline.animators.ropes import AnimatorRopes, RopesConfig
from hemline.animators.ropes.layout import lay_out
from hemline.animators.ropes.mlp import Mlp
from hemline.animators.ropes.reconstruct import pack_basis


def made() -> AnimatorRopes:
    """A model of the paper's size."""
    random = np.random.default_rng(0)
    body, garment, config = bodies.load("anny24").shaped(), garments.load("cape"), RopesConfig()
    ropes = lay_out(garment, body)
    modes, ins = config.components, 3 * ropes.node_count
    basis = random.normal(size=(2 * modes, garment.vertices.size)).astype(np.float32) / 200

    def network() -> Mlp:
        sizes = ((config.hidden, ins), (config.hidden, config.hidden), (modes, config.hidden))
        weights = [random.normal(size=size) / np.sqrt(size[1]) for size in sizes]
        return Mlp.rounded(weights, [np.zeros(size[0]) for size in sizes])

    first = pack_basis(basis[:modes], np.ones(modes), extra=config.second_columns)
    second = pack_basis(basis[modes:], np.ones(modes))
    return AnimatorRopes(garment, ropes, garment.vertices, first, second, network(), network(),
                         body_name=body.body.name, body_hash=body.body.hash, config=config)  # fmt: skip


def timed(name: str, work: Callable[[], object], count: int = 500) -> None:
    work()
    spans = []
    for _ in range(count):
        began = time.perf_counter()
        work()
        spans.append(1e3 * (time.perf_counter() - began))
    print(f"{name:<16} min {min(spans):.3f}  median {statistics.median(spans):.3f} ms")


def main() -> None:
    model = made()
    with tempfile.TemporaryDirectory() as folder:
        model.save(Path(folder, "model.safetensors"))
        print(f"model file       {Path(folder, 'model.safetensors').stat().st_size / 1e6:.2f} MB")
    body = bodies.load(model.body_name).shaped()
    posed = body.posed(body.rest_pose)
    state = model.start(posed)
    random, key = np.random.default_rng(1), posed.transforms[model.key]
    moved = random.normal(size=3 * model.ropes.node_count).astype(np.float32)
    coefficients = random.normal(size=model.basis.mode_count).astype(np.float32)
    bones = state.ropes.positions
    timed("networks", lambda: (model.skinning(moved), model.shape(moved)))
    timed("reconstruction", lambda: model.basis.vertices(coefficients, model.rest, key))
    timed("learned part", lambda: model.step(state, posed, 1 / 60, bones=bones))
    timed("whole animator", lambda: model.step(state, posed, 1 / 60))


if __name__ == "__main__":
    main()
