"""Benchmark of `lag` on garments that it was not trained on."""

import time
from typing import Any

import numpy as np

from hemline import animators, bodies, garments, motions

GARMENTS = ("cape-light", "skirt-light", "dress-light", "tshirt-light", "cape")
CLIPS = ("walk", "kick")
FRAMES = 90


def bench_lag() -> dict[str, Any]:
    """Animator time of `lag` on light cape, skirt, dress and T-shirt and on the full cape, all cores."""
    from hemline.compiled import use_threads

    use_threads(None)
    return {name: _animator_times(name) for name in GARMENTS}


def _animator_times(name: str) -> dict[str, Any]:
    body = bodies.load("anny24").shaped()
    began = time.perf_counter()
    animator = animators.load("lag").animator_for(garments.load(name), body)
    ready, spans = time.perf_counter() - began, []
    for clip in ("run", *CLIPS):
        motion = body.placed(motions.load(clip))
        posed = [body.posed(motion[frame]) for frame in range(min(FRAMES, len(motion)))]
        state = animator.start(posed[0])
        for pose in posed[1:]:
            began = time.perf_counter()
            state, _ = animator.step(state, pose, 1 / motion.fps)
            spans.append(1e3 * (time.perf_counter() - began))
        if clip == "run":
            spans.clear()  # the first clip compiles
    return {
        "animator_ms_median": float(np.median(spans)),
        "animator_ms_p95": float(np.percentile(spans, 95)),
        "vertices": len(animator.garment.vertices),
        "proxy_vertices": len(animator.rest),
        "ready_s": ready,
    }
