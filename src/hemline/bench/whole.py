"""Benchmark of the whole-cloth step: its time, and what it saves the projection."""

from typing import Any

from hemline import animators, bodies, motions
from hemline.metrics import frame_ms
from hemline.playback.play import play


def bench_whole_cape() -> dict[str, Any]:
    """The whole-cloth step on the shipped cape, six excerpts, one core; the projection with and without it."""
    return _whole("cape")


def bench_whole_skirt() -> dict[str, Any]:
    """The same on the shipped skirt."""
    return _whole("skirt")


def _whole(model: str) -> dict[str, Any]:
    from hemline.compiled import use_threads

    use_threads(1)
    worn = animators.load(model)
    body = bodies.load(worn.body_name).shaped()
    stages: dict[str, list[dict[str, float]]] = {"whole": [], "projection": [], "projection_alone": []}
    for _ in play(worn, body, motions.load("run")[:3]):
        pass  # compile outside the measured frames
    for name in motions.names():
        for frame in play(worn, body, motions.load(name)):
            for stage in ("whole", "projection"):
                stages[stage].append({stage: frame.milliseconds[stage]})
        for frame in play(worn, body, motions.load(name), whole=False):
            stages["projection_alone"].append({"projection": frame.milliseconds["projection"]})
    figures = {f"{name}_ms": frame_ms(spans) for name, spans in stages.items()}
    return {"vertices": len(worn.garment.vertices), "frames": len(stages["whole"])} | figures
