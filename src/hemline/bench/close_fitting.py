"""Benchmarks of AgentDress: a frame, a new body shape, a hundred agents, and a garment of the paper's size."""

import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from hemline import animators, bodies, garments, motions
from hemline.animators.agentdress.binding import Binding
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.animators.agentdress.shape_samples import ShapeSamples
from hemline.animators.agentdress.tables import Tables
from hemline.bodies import ShapedBody
from hemline.garments import Garment
from hemline.learning.packed_basis import PackedBasis
from hemline.meshes import ClosestTree
from hemline.metrics import frame_ms, model_mb
from hemline.motions.quaternions import from_axis_angle, multiply
from hemline.playback import Player, crowd

AGENTS = 100
CROWD_FRAMES = 30
RESHAPED_BODIES = 50
"""Number of body shapes that a shape slider runs through."""
PAPER_ANCHORS = 150


def bench_tshirt() -> dict[str, Any]:
    """Frame time of the shipped T-shirt by stage and time of a new body shape, on the six excerpts, one core."""
    return _one_agent(_load("tshirt-light"))


def bench_tshirt_paper_size() -> dict[str, Any]:
    """Frame time and size of the shipped T-shirt interpolated to the paper's size (12,414 vertices, 150 anchors)."""
    return _one_agent(_refine(_load("tshirt-light"), garments.load("tshirt"), PAPER_ANCHORS))


def bench_crowd_tshirt() -> dict[str, Any]:
    """Time per agent of a hundred T-shirts on different shapes and poses in one call, all cores.

    Also measures how long a joining agent waits; first with full detail, then with half of the vertices.
    """
    from hemline.compiled import use_threads

    use_threads(None)
    full = _crowd_times(1.0)
    return {"agents": AGENTS} | full | {f"{name}_half": value for name, value in _crowd_times(0.5).items()}


def _crowd_times(detail: float) -> dict[str, float]:
    """Returns the times of a crowd whose garments all have one level of detail [ms]."""
    clips = [motions.load(name) for name in motions.names()]
    player = Player.prepare(_load("tshirt-light"), bodies.load("anny24").shaped(), detail=detail)
    starts = [player.start(clip[0]) for clip in clips]
    joined, waited = [], []
    for number, betas in enumerate(_shapes(AGENTS)):
        began = time.perf_counter()
        joined.append(player.reshape(starts[number % len(clips)], player.body.body.shaped(betas)))
        waited.append((time.perf_counter() - began) * 1e3)
    players, states, spans = [player for player, _ in joined], [state for _, state in joined], []
    for frame in range(CROWD_FRAMES):
        poses = [clips[n % len(clips)][(frame + 7 * n) % len(clips[n % len(clips)])] for n in range(AGENTS)]
        began = time.perf_counter()
        states, _ = crowd(players, states, poses, 1 / 30)
        spans.append((time.perf_counter() - began) * 1e3 / AGENTS)
    return {
        "agent_ms": float(np.median(spans)),
        "agent_ms_p95": float(np.percentile(spans, 95)),
        "joining_ms": float(np.median(waited)),
        "joining_ms_worst": float(np.max(waited)),
    }


def _load(name: str) -> AnimatorAgentDress:
    model = animators.load(name)
    assert isinstance(model, AnimatorAgentDress)
    return model


def _one_agent(model: AnimatorAgentDress) -> dict[str, Any]:
    from hemline.compiled import use_threads

    use_threads(1)
    body = bodies.load(model.body_name)
    player = Player.prepare(model, body.shaped())
    player.warm_up(motions.load("run")[0])
    frames = []
    for name in motions.names():
        motion = motions.load(name)
        state = player.start(motion[0])
        for index in range(len(motion)):
            state, frame = player.step(state, motion[index], 1 / 30)
            frames.append(dict(frame.milliseconds))
    before = frame_ms([{"body": frame["body"], "animator": frame["animator"]} for frame in frames])
    return {
        "vertices": len(model.garment.vertices),
        "anchors": model.tables.shapes.pose_count,
        "poses": len(model.tables.rotations),
        "model_mb": _model_mb(model),
        "frame_ms": frame_ms(frames),
        "before_the_projection_ms": {name: before[name] for name in ("median", "p95")},
        "new_shape_ms": _new_shape_ms(player, [body.shaped(betas) for betas in _shapes(RESHAPED_BODIES)]),
    }


def _model_mb(model: AnimatorAgentDress) -> float:
    """Returns the size of the model file [MB]."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "model.safetensors"
        model.save(path)
        return model_mb(path)


def _new_shape_ms(player: Player, shapes: Sequence[ShapedBody]) -> float:
    """Returns the median time to adapt all anchors of the garment to a new body shape, without the body itself [ms]."""
    state, spans = player.start(motions.load("run")[0]), []
    for shaped in shapes:
        began = time.perf_counter()
        player.reshape(state, shaped)
        spans.append((time.perf_counter() - began) * 1e3)
    return float(np.median(spans))


def _shapes(count: int) -> list[np.ndarray]:
    return list(np.random.default_rng(0).uniform(-2, 2, size=(count, 4)).astype(np.float32))


def _refine(model: AnimatorAgentDress, garment: Garment, anchors: int) -> AnimatorAgentDress:
    """Interpolates the tables of a model to a finer mesh, and repeats its anchors in nearby poses."""
    tables, random, body = model.tables, np.random.default_rng(0), bodies.load(model.body_name).shaped()
    closest = ClosestTree(model.garment.vertices.astype(np.float64), model.garment.faces).closest(garment.vertices)
    corners = model.garment.faces[closest.faces]

    def interpolate(values: np.ndarray) -> np.ndarray:
        """Interpolates values at the vertices of the coarse mesh to those of the fine mesh."""
        return np.einsum("vc,vc...->v...", closest.weights, values[corners].astype(np.float64)).astype(np.float32)

    binding = Binding.of(garment.vertices, garment.faces, body.posed(body.rest_pose))
    sources, basis = np.arange(anchors) % tables.shapes.pose_count, tables.basis
    turns = from_axis_angle(random.normal(scale=0.05, size=(anchors, tables.rotations.shape[1], 3)))
    digits = np.rint(interpolate(basis.digits.reshape(-1, 3, basis.digits.shape[1]))).astype(np.int8)
    refined = Tables(
        indices=binding.indices,
        weights=binding.weights,
        nearest=binding.nearest,
        regions=interpolate(tables.regions),
        axes=tables.axes,
        rotations=np.concatenate([multiply(tables.rotations[sources], turns), tables.rotations]).astype(np.float32),
        rest=garment.vertices + interpolate(tables.rest - model.garment.vertices),
        rest_effects=np.stack([interpolate(effect) for effect in tables.rest_effects]),
        offset=interpolate(tables.offset),
        basis=PackedBasis(digits.reshape(-1, basis.digits.shape[1]), basis.scales, basis.modes),
        pose_weights=np.concatenate([0.0 * tables.pose_weights[:, sources], tables.pose_weights], axis=1),
        shapes=_repeat(tables.shapes, sources),
    )
    return replace(model, garment=garment, tables=refined)


def _repeat(samples: ShapeSamples, poses: np.ndarray) -> ShapeSamples:
    """Repeats the samples of some poses, in the order and as often as the poses are listed."""
    rows = [np.flatnonzero(samples.poses == pose) for pose in poses]
    numbers = np.repeat(np.arange(len(poses), dtype=np.int32), [len(row) for row in rows])
    order = np.concatenate(rows)
    sizes = None if samples.sizes is None else samples.sizes[:, order]
    return replace(samples, poses=numbers, betas=samples.betas[order], weights=samples.weights[:, order], sizes=sizes)
