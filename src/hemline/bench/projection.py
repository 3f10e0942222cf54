"""Benchmarks of the final projection by stage, on the shipped cape and on synthetic garments."""

import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from hemline import animators, bodies, garments, motions
from hemline.arrays import Vertices
from hemline.bodies import PosedBody, ShapedBody
from hemline.collide import Projector, inside
from hemline.collide.projection.project_frame import ProjectedFrame
from hemline.metrics import frame_ms
from hemline.playback.play import play

STAGES = {
    "vertices_near_skin": "certify",
    "displace_vertices": "displace",
    "find_blocked": "test",
    "lead_out": "lead_out",
}
"""Stage names by method of `ProjectedFrame`; the stage `frame` precedes them and `write_back` follows them."""
UPPER = [
    joint
    for joint, name in enumerate(motions.JOINT_NAMES)
    if name.startswith("spine") or name.endswith(("collar", "shoulder"))
]
"""Joints of the body part that a shirt covers."""
Garment = Callable[[PosedBody, float], Vertices]
"""Positions of a synthetic garment, given the posed body and the time [s]."""


def bench_projection_cape() -> dict[str, Any]:
    """Body skinning and projection of the shipped cape on the six excerpts, one core."""
    cape = animators.load("cape")
    body = bodies.load(cape.body_name).shaped()
    clips = [
        [(frame.body.pose, frame.before_projection) for frame in play(cape, body, motions.load(name))]
        for name in motions.names()
    ]
    return _projection_times(body, cape.garment.vertices, clips)


def bench_projection_sheet() -> dict[str, Any]:
    """Body skinning and projection of a cape (12,690 vertices) that sways, carried by the chest, one core."""
    cape = garments.load("cape")
    low, across = cape.vertices[:, 1].max() - cape.vertices[:, 1], cape.vertices[:, 0]
    return _swaying_garment(cape.vertices, 9, lambda seconds: 0.05 * low * np.sin(5 * seconds + 5 * across))


def bench_projection_skirt() -> dict[str, Any]:
    """Body skinning and projection of a skirt (18,546 vertices) that sways, carried by the pelvis, one core."""
    body = bodies.load().shaped()
    turn, down = np.meshgrid(np.linspace(0, 2 * np.pi, 281, endpoint=False), np.linspace(0, 0.6, 66))
    wide = 0.02 + 0.3 * down
    x, z = (0.17 + wide) * np.cos(turn), (0.14 + wide) * np.sin(turn)
    rest = body.joints[0] + np.stack([x, 0.05 - down, z], axis=-1).reshape(-1, 3)
    return _swaying_garment(rest, 0, lambda seconds: (0.1 * down * np.sin(5 * seconds + 2 * turn)).reshape(-1))


def bench_projection_shirt() -> dict[str, Any]:
    """Body skinning and projection of a shirt (12,000 vertices) on the skin, 3 mm above to 6 mm below, one core."""
    body, random = bodies.load().shaped(), np.random.default_rng(0)
    covered = np.isin(body.body.weight_indices[np.arange(len(body.vertices)), body.body.weights.argmax(axis=1)], UPPER)
    faces = body.body.faces[covered[body.body.faces].all(axis=1)]
    corners, weights = faces[random.integers(0, len(faces), 12_000)], random.dirichlet([1, 1, 1], 12_000)
    waves, phase = random.normal(size=(3, 16)) * 2 * np.pi / 0.3, random.uniform(2, 9, 16)

    def on_skin(posed: PosedBody, height: np.ndarray) -> np.ndarray:
        place, normal = (
            np.einsum("nc,nck->nk", weights, each[corners]) for each in (posed.vertices, posed.skinned_normals)
        )
        return (place + normal * height[:, None]).astype(np.float32)

    rest = on_skin(body.posed(body.rest_pose), np.zeros(12_000))
    swing = rest @ waves

    def garment(posed: PosedBody, seconds: float) -> Vertices:
        return on_skin(posed, 0.003 + 0.005 * np.sin(swing + phase * seconds).sum(axis=1) / np.sqrt(8))

    return _projection_times(body, rest, _clips(body, garment))


class _TimedFrame(ProjectedFrame):
    """Frame of the projection that records the time of each of its stages [ms]."""

    def __init__(self, *arguments: Any):
        self.spans: dict[str, float] = {}
        began = time.perf_counter()
        super().__init__(*arguments)
        self.spans["frame"] = (time.perf_counter() - began) * 1e3

    def __getattribute__(self, name: str) -> Any:
        value = super().__getattribute__(name)
        if name not in STAGES:
            return value

        def timed(*arguments: Any) -> Any:
            began = time.perf_counter()
            result = value(*arguments)
            self.spans[STAGES[name]] = (time.perf_counter() - began) * 1e3
            return result

        return timed


def _swaying_garment(rest: np.ndarray, joint: int, sway: Callable[[float], np.ndarray]) -> dict[str, Any]:
    """Times a garment that moves rigidly with one joint and sways forward and back."""
    body = bodies.load().shaped()

    def garment(posed: PosedBody, seconds: float) -> Vertices:
        local = rest + sway(seconds)[:, None] * [0, 0, 1]
        return (local @ posed.transforms[joint, :, :3].T + posed.transforms[joint, :, 3]).astype(np.float32)

    return _projection_times(body, rest.astype(np.float32), _clips(body, garment))


def _clips(body: ShapedBody, garment: Garment) -> Iterator[list[tuple[Any, Vertices]]]:
    for name in motions.names():
        motion = body.placed(motions.load(name)).resample(30)
        yield [(motion[i], garment(body.posed(motion[i]), i / 30)) for i in range(len(motion))]


def _projection_times(body: ShapedBody, rest: Vertices, clips: Any) -> dict[str, Any]:
    """Returns the times by stage [ms] over clips of poses and vertices, and the amount of work."""
    from hemline.compiled import use_threads

    use_threads(1)
    projector = Projector.prepare(body, rest, np.empty((0, 3), np.int32), measure=False)
    frames, before, moved, pinched = [], [], [], 0
    for clip in clips:
        state = projector.start()
        for number, (pose, vertices) in enumerate(clip):
            began = time.perf_counter()
            posed = body.posed(pose)
            _ = posed.vertices
            between = time.perf_counter()
            timed = _TimedFrame(projector, state, posed, vertices)
            state, _, report = timed.project(1 / 30)
            total, skinning = (time.perf_counter() - between) * 1e3, (between - began) * 1e3
            frames.append({"body": skinning} | timed.spans | {"write_back": total - sum(timed.spans.values())})
            if number % 10 == 0:
                before.append(inside(posed.vertices, posed.faces, vertices).mean())
            moved.append(report.moved)
            pinched += len(report.pinched)
    return {
        "vertices": len(rest),
        "frames": len(frames) - 1,
        "frame_ms": frame_ms(frames[1:]),  # the first one compiles
        "inside_before_percent": 100 * float(np.mean(before)),
        "moved": float(np.mean(moved)),
        "pinched": pinched,
    }
