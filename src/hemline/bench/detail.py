"""Benchmarks of levels of detail: cost and error of each level, and a hundred capes in one call."""

import time
from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from hemline import animators, bodies, metrics, motions
from hemline.animators.base import Level
from hemline.bodies import ShapedBody
from hemline.collide import inside
from hemline.meshes import rest_lengths
from hemline.metrics import frame_ms
from hemline.playback import Frame, Player, PlayerState, crowd, detail_for
from hemline.playback.detail import DETAILS

CAPES = 100
NEAREST_CAPE, FARTHEST_CAPE = 2.0, 40.0
"""Distances of the crowd from the camera [m]."""
CROWD_FRAMES = 60
INSIDE_STRIDE = 5
"""Number of frames between two inside tests."""


def bench_detail_cape() -> dict[str, Any]:
    """Frame time by stage and error of the shipped cape at each level of detail, on the six excerpts, one core."""
    from hemline.compiled import use_threads

    use_threads(1)
    players = _players(bodies.load(animators.load("cape").body_name).shaped())
    rows: dict[float, dict[str, list[Any]]] = {detail: {} for detail in players}
    for name in motions.names():
        motion = motions.load(name)
        full: list[Frame] = []
        for detail, player in players.items():
            frames = _play(player, motion)
            full = full or frames
            _measure(player, frames, full, rows[detail])
    return {f"detail {detail}": _figures(player, rows[detail]) for detail, player in players.items()}


def bench_crowd_cape() -> dict[str, Any]:
    """Time per cape of a hundred capes in one call, all cores, at each level and at levels by distance (2 to 40 m)."""
    from hemline.compiled import use_threads

    use_threads(None)
    players = _players(bodies.load(animators.load("cape").body_name).shaped())
    errors = {detail: player.error for detail, player in players.items()}
    # an even density over the ground in view
    near, far = NEAREST_CAPE, FARTHEST_CAPE
    distances = np.sqrt(near**2 + (np.arange(CAPES) + 0.5) / CAPES * (far**2 - near**2))
    chosen = [detail_for(float(distance), errors) for distance in distances]
    counts = Counter(chosen)
    return {f"detail {detail}": _crowd_ms([player] * CAPES) for detail, player in players.items()} | {
        "by distance": {"capes": {f"detail {detail}": counts[detail] for detail in players}}
        | _crowd_ms([players[detail] for detail in chosen])
    }


def _players(body: ShapedBody) -> dict[float, Player]:
    """Returns a compiled player of each level."""
    cape, motion = animators.load("cape"), motions.load("run")
    players = {detail: Player.prepare(cape, body, detail=detail) for detail in DETAILS}
    for player in players.values():
        player.warm_up(motion[0])
    return players


def _play(player: Player, motion: motions.Motion) -> list[Frame]:
    state, frames = player.start(motion[0]), []
    for index in range(len(motion)):
        state, frame = player.step(state, motion[index], 1 / 30)
        frames.append(frame)
    return frames


def _measure(player: Player, frames: list[Frame], full: list[Frame], row: dict[str, list[Any]]) -> None:
    """Adds the measurements of a clip to those of a level."""
    garment, animator = player.garment, player.animator
    kept = animator.vertex_ids if isinstance(animator, Level) else slice(None)
    edges, lengths = rest_lengths(garment.faces, garment.rest_edges)
    counted = ~np.isin(edges, garment.pins.vertices).all(axis=1)
    for number, (frame, whole) in enumerate(zip(frames, full, strict=True)):
        row.setdefault("ms", []).append(dict(frame.milliseconds))
        row.setdefault("error", []).append(metrics.vertex_errors_mm(frame.vertices, whole.vertices[kept]).mean())
        stretch = metrics.stretch_percent(frame.vertices, edges[counted], lengths[counted])
        row.setdefault("stretch", []).append(stretch[0])
        if number % INSIDE_STRIDE == 0:
            skin, faces = frame.body.vertices, frame.body.faces
            within = inside(skin, faces, frame.vertices)
            within[frame.report.pinched] = False
            row.setdefault("inside", []).append(metrics.inside_percent(within))
            row.setdefault("deepest", []).append(metrics.deepest_mm(skin, faces, frame.vertices, within))


def _figures(player: Player, row: dict[str, list[Any]]) -> dict[str, Any]:
    return {
        "vertices": len(player.garment.vertices),
        "body_vertices": len(player.collider.vertices),
        "full_body": player.collider is player.body,
        "geometric_error_mm": 1000 * player.error,
        "frame_ms": frame_ms(row["ms"]),
        "from_full_mm": float(np.mean(row["error"])),
        "stretch_p99_percent": float(np.mean(row["stretch"])),
        "inside_percent": metrics.mean_and_worst(row["inside"]),
        "deepest_mm": max(row["deepest"]),
    }


def _crowd_ms(players: Sequence[Player]) -> dict[str, float]:
    """Returns the time per cape [ms] and the number of cores used, with bodies that move as in the excerpts."""
    clips = [motions.load(name) for name in motions.names()]
    starts: dict[tuple[int, int], PlayerState] = {}
    states = []
    for number, player in enumerate(players):
        key = (id(player), number % len(clips))
        if key not in starts:
            starts[key] = player.start(clips[key[1]][0])
        states.append(starts[key])
    spans, worked, began_all = [], time.process_time(), time.perf_counter()
    for frame in range(CROWD_FRAMES):
        poses = [clips[n % len(clips)][frame % len(clips[n % len(clips)])] for n in range(len(players))]
        began = time.perf_counter()
        states, _ = crowd(players, states, poses, 1 / 30)
        spans.append((time.perf_counter() - began) * 1e3 / len(players))
    return {
        "cape_ms": float(np.median(spans)),
        "cape_ms_p95": float(np.percentile(spans, 95)),
        "cores_used": (time.process_time() - worked) / (time.perf_counter() - began_all),
    }
