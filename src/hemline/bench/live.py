"""Benchmark of `live`: garments simulated while they are shown."""

import time
from typing import Any

from hemline import animators, bodies, garments, motions
from hemline.animators.live import Live, LiveConfig
from hemline.metrics import frame_ms
from hemline.playback.play import play

GARMENTS = ("cape-light", "skirt-light", "dress-light")
CLIPS = ("walk", "kick", "dance")
FRAMES = 90
RUNS = 2
"""A frame's time is the least of so many: all runs have the same bits, and other work on the machine is left out."""


def bench_live() -> dict[str, Any]:
    """Light cape, skirt and dress simulated with 1,000 vertices on three excerpts, all cores, at each quality."""
    from hemline.compiled import use_threads

    use_threads(None)
    return {name: {each: _timed(name, each) for each in ("fast", "good", "fine")} for name in GARMENTS}


def _timed(name: str, quality: str) -> dict[str, Any]:
    config = LiveConfig(edge=0.02, most=1000, quality=quality)  # type: ignore[arg-type]
    body = bodies.load("anny24").shaped()
    began = time.perf_counter()
    worn = Live(config).animator_for(garments.load(name), body)
    ready = time.perf_counter() - began
    for _ in play(worn, body, motions.load("run")[:3]):
        pass  # compile outside the measured frames
    frames = [frame for clip in CLIPS for frame in _least(worn, body, clip)]
    return {"frame_ms": frame_ms(frames), "frames": len(frames), "ready_s": ready} | dict(worn.figures)


def _least(worn: animators.Animator, body: bodies.ShapedBody, clip: str) -> list[dict[str, float]]:
    """The least time of each stage of each frame."""
    runs = [[frame.milliseconds for frame in play(worn, body, motions.load(clip)[:FRAMES])] for _ in range(RUNS)]
    return [{stage: min(each[stage] for each in same) for stage in same[0]} for same in zip(*runs, strict=True)]
