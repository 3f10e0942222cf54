"""Benchmark of `live`, which simulates garments in real time."""

import time
from typing import Any

from hemline import animators, bodies, garments, motions
from hemline.animators.live import Live, LiveConfig
from hemline.metrics import frame_ms
from hemline.playback.play import play

GARMENTS = ("cape-light", "skirt-light", "dress-light")
QUALITIES = ("fast", "good", "fine", "exact")
CLIPS = ("walk", "kick", "dance")
FRAMES = 90
RUNS = 2
"""Number of equal runs. The time of a frame is its minimum over them, to exclude other load on the machine."""


def bench_live() -> dict[str, Any]:
    """Frame time of light cape, skirt and dress, simulated on three excerpts on one core, at each quality."""
    from hemline.compiled import use_threads

    use_threads(1)
    return {name: {quality: _frame_times(name, quality) for quality in QUALITIES} for name in GARMENTS}


def _frame_times(name: str, quality: str) -> dict[str, Any]:
    config = LiveConfig(quality=quality)  # type: ignore[arg-type]
    body = bodies.load("anny24").shaped()
    began = time.perf_counter()
    animator = Live(config).animator_for(garments.load(name), body)
    ready = time.perf_counter() - began
    for _ in play(animator, body, motions.load("run")[:3]):
        pass  # compiles before the measured frames
    frames = [frame for clip in CLIPS for frame in _fastest(animator, body, clip)]
    return {"frame_ms": frame_ms(frames), "frames": len(frames), "ready_s": ready} | dict(animator.figures)


def _fastest(animator: animators.Animator, body: bodies.ShapedBody, clip: str) -> list[dict[str, float]]:
    """Returns the minimum time of each stage of each frame over all runs."""
    runs = [[frame.milliseconds for frame in play(animator, body, motions.load(clip)[:FRAMES])] for _ in range(RUNS)]
    return [{stage: min(run[stage] for run in frame) for stage in frame[0]} for frame in zip(*runs, strict=True)]
