"""Table of the benchmarks of `hemline bench`, by name."""

import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from hemline import animators, bodies, garments, motions, sim
from hemline.metrics import frame_ms
from hemline.playback.play import play

from .close_fitting import bench_crowd_tshirt, bench_tshirt, bench_tshirt_paper_size
from .detail import bench_crowd_cape, bench_detail_cape
from .lag import bench_lag
from .live import bench_live
from .machine import commit, machine
from .projection import bench_projection_cape, bench_projection_sheet, bench_projection_shirt, bench_projection_skirt
from .simulator import bench_sensitivity, bench_settle
from .whole import bench_whole_cape, bench_whole_skirt


def bench_cape() -> dict[str, Any]:
    """Frame time of the shipped cape by stage, on the six shipped excerpts, one core."""
    return _frame_times("cape")


def bench_skirt() -> dict[str, Any]:
    """Frame time of the shipped skirt (18,546 vertices) by stage, on the six shipped excerpts, one core."""
    return _frame_times("skirt")


def bench_sim_4k() -> dict[str, Any]:
    """Simulation of the light cape (about 4,000 vertices) on a second of running, with body contact, all cores."""
    return _simulate("cape-light", self_contact=False)


def bench_sim_12k() -> dict[str, Any]:
    """Simulation of the full cape (12,690 vertices) on a second of running, with body contact, all cores."""
    return _simulate("cape", self_contact=False)


def bench_sim_12k_self() -> dict[str, Any]:
    """Simulation of the full cape (12,690 vertices) on a second of running, with body and self-contact, all cores."""
    return _simulate("cape", self_contact=True)


BENCHMARKS: dict[str, Callable[[], dict[str, Any]]] = {
    "cape": bench_cape,
    "skirt": bench_skirt,
    "tshirt": bench_tshirt,
    "tshirt-paper-size": bench_tshirt_paper_size,
    "crowd-tshirt": bench_crowd_tshirt,
    "detail-cape": bench_detail_cape,
    "crowd-cape": bench_crowd_cape,
    "live": bench_live,
    "lag": bench_lag,
    "whole-cape": bench_whole_cape,
    "whole-skirt": bench_whole_skirt,
    "projection-cape": bench_projection_cape,
    "projection-sheet": bench_projection_sheet,
    "projection-skirt": bench_projection_skirt,
    "projection-shirt": bench_projection_shirt,
    "sim-4k": bench_sim_4k,
    "sim-12k": bench_sim_12k,
    "sim-12k-self": bench_sim_12k_self,
    "settle": bench_settle,
    "sensitivity": bench_sensitivity,
}


def run_benchmark(name: str) -> dict[str, Any]:
    """Runs one benchmark.

    Args:
        name: A key of `BENCHMARKS`.

    Returns:
        `name`, `figures`, `machine`, `threads`, `commit`, `date`.
    """
    figures = BENCHMARKS[name]()
    from hemline.compiled import threads

    return {
        "name": name,
        "figures": figures,
        "machine": machine(),
        "threads": threads(),
        "commit": commit(),
        "date": time.strftime("%Y-%m-%d"),
    }


def _one_thread() -> None:
    from hemline.compiled import use_threads

    use_threads(1)


def _frame_times(name: str) -> dict[str, Any]:
    _one_thread()
    model = animators.load(name)
    frames = [frame.milliseconds for frame in _play_all(model)]
    return {"frame_ms": frame_ms(frames), "frames": len(frames)} | _animator_stages(model)


def _play_all(model: Any) -> Iterator[Any]:
    body = bodies.load(model.body_name).shaped()
    for _ in play(model, body, motions.load("run")[:3]):
        pass  # compiles and warms the caches before the measured frames
    for name in motions.names():
        yield from play(model, body, motions.load(name))


def _animator_stages(model: Any) -> dict[str, Any]:
    """Returns the median times of bones and of networks on the clip `run` [ms]."""
    body = bodies.load(model.body_name).shaped()
    motion = body.placed(motions.load("run"))
    poses = [body.posed(motion[i]) for i in range(len(motion))]
    state, times = model.start(poses[0]), []
    moving = state.bones
    for posed in poses:
        before = time.perf_counter()
        moving, _ = model.source.step(moving, posed, 1 / 30, state.rest_bones)
        between = time.perf_counter()
        model.step(state, posed, 1 / 30, bones=moving.ropes.positions)
        times.append((between - before, time.perf_counter() - between))
    bones_ms, networks_ms = np.median(np.array(times) * 1e3, axis=0)
    return {"bones_ms": float(bones_ms), "networks_ms": float(networks_ms)}


def _simulate(name: str, *, self_contact: bool) -> dict[str, Any]:
    from hemline.compiled import use_threads

    use_threads(None)
    garment = garments.load(name)
    body = bodies.load(garment.body_name).shaped()
    motion = body.untangle_motion(body.placed(motions.load("run").resample(30)))
    settings = sim.SimSettings(self_contact=self_contact)
    rest = sim.rest_drape(garment, body, settings)
    stamps = []
    take = sim.simulate(
        garment,
        body,
        motion[:45],
        settings,
        start=rest,
        progress=lambda *_: stamps.append(time.perf_counter()),
    )
    spans = np.diff(stamps)[take.lead_in.sum() :] * 1e3
    return {
        "vertices": len(garment.vertices),
        "frame_ms": frame_ms([{"simulation": float(span)} for span in spans]),
        **{name: take.figures[name] for name in ("edge_strain_p99", "inside", "self_crossing_percent_max")},
    }
