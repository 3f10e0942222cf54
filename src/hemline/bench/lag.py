"""Benchmark of `lag`: garments that nobody trained on, stage by stage."""

import time
from typing import Any

import numpy as np

from hemline import animators, bodies, garments, motions

GARMENTS = ("cape-light", "skirt-light", "dress-light", "tshirt-light", "cape")
CLIPS = ("walk", "kick")
FRAMES = 90


def bench_lag() -> dict[str, Any]:
    """Shipped weights on light cape, skirt, dress and T-shirt and on the cape of 12,690 vertices, all cores."""
    from hemline.compiled import use_threads

    use_threads(None)
    return {name: _timed(name) for name in GARMENTS}


def _timed(name: str) -> dict[str, Any]:
    body = bodies.load("anny24").shaped()
    began = time.perf_counter()
    worn = animators.load("lag").animator_for(garments.load(name), body)
    ready, spans = time.perf_counter() - began, []
    for clip in ("run", *CLIPS):
        motion = body.placed(motions.load(clip))
        posed = [body.posed(motion[frame]) for frame in range(min(FRAMES, len(motion)))]
        state = worn.start(posed[0])
        for each in posed[1:]:
            began = time.perf_counter()
            state, _ = worn.step(state, each, 1 / motion.fps)
            spans.append(1e3 * (time.perf_counter() - began))
        if clip == "run":
            spans.clear()  # compiled outside the measured frames
    return {
        "animator_ms_median": float(np.median(spans)),
        "animator_ms_p95": float(np.percentile(spans, 95)),
        "vertices": len(worn.garment.vertices),
        "proxy_vertices": len(worn.rest),
        "ready_s": ready,
    }
