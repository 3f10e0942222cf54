"""Benchmarks of the whole-cloth step: its time, and the time that the projection saves by it."""

from typing import Any

from hemline import animators, bodies, motions
from hemline.metrics import frame_ms
from hemline.playback.play import play


def bench_whole_cape() -> dict[str, Any]:
    """Time of the whole-cloth step on the shipped cape, and of the projection with and without it, one core."""
    return _whole("cape")


def bench_whole_skirt() -> dict[str, Any]:
    """Time of the whole-cloth step on the shipped skirt, and of the projection with and without it, one core."""
    return _whole("skirt")


def _whole(model: str) -> dict[str, Any]:
    from hemline.compiled import use_threads

    use_threads(1)
    animator = animators.load(model)
    body = bodies.load(animator.body_name).shaped()
    stages: dict[str, list[dict[str, float]]] = {"whole": [], "projection": [], "projection_alone": []}
    for _ in play(animator, body, motions.load("run")[:3]):
        pass  # compiles before the measured frames
    for name in motions.names():
        for frame in play(animator, body, motions.load(name)):
            for stage in ("whole", "projection"):
                stages[stage].append({stage: frame.milliseconds[stage]})
        for frame in play(animator, body, motions.load(name), whole=False):
            stages["projection_alone"].append({"projection": frame.milliseconds["projection"]})
    figures = {f"{name}_ms": frame_ms(spans) for name, spans in stages.items()}
    return {"vertices": len(animator.garment.vertices), "frames": len(stages["whole"])} | figures
