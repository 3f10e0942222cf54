"""Fit the constants of rope chains to simulated bones, so that they swing as the cloth does."""

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Float
from hemline.errors import BadDataset
from hemline.motions import Motion

from .chains import Ropes
from .constants import RopeConstants
from .rope_force_kernels import LATERAL_BOUND, REST_ANGLE_BOUND, SHRINK_BOUND
from .state import RopesState

if TYPE_CHECKING:
    from hemline.bodies import PosedBody, ShapedBody

Clip = tuple[Motion, Float[np.ndarray, "frames nodes 3"]]
"""The poses of a clip, and all bones on the simulated garment in each (`Ropes.embedded`) [m]."""

_STEPS = (4.0, 2.0, 1.4)
_ROUNDS = 2
_SMALLEST = 0.05
_LENGTHS = (50.0, 75.0, 90.0, 99.0)
"""Percentiles of the simulated spans of a rope that are tried as its length, besides the one it has."""
_TREMBLE = 1 / 30
"""What trembles within this time is an error [s]."""
_CLEARANCE = 2.0
"""Percentile of a bone's simulated distance to the proxy that it may come close to."""


def calibrated(
    ropes: Ropes,
    shaped: "ShapedBody",
    clips: Sequence[Clip],
    *,
    window_seconds: float = 1.0,
    window_count: int = 12,
    progress: Callable[[str, int, int], None] | None = None,
) -> Ropes:
    """The same bones on lengths, clearances and constants that bring them closest to simulated ones.

    Each bone may come as close to the body's primitives as the simulated one did (they are rougher than the skin). The
    length of each rope stays, or is a percentile of its simulated span, the same for all. Then a compass search over
    drag, springs, damping and friction: each is multiplied and divided by a step, what helps is kept, the step shrinks.
    The error is the mean distance to the ground truth over windows that start from it, and as much again of how far
    the trembling is off: without that, ropes that shake around the right place would be the best.

    Args:
        ropes: Bones laid on the garment that was simulated, and the constants to begin with.
        shaped: The body of the clips.
        clips: Poses and simulated bones, frame by frame.
        window_seconds: Length of a window [s].
        window_count: Windows, spread evenly over all clips.
        progress: Called with "ropes", tries done and most tries.

    Returns:
        Ropes whose springs and damping are below what the longest substep can follow.

    Raises:
        BadDataset: Bones that do not fit the ropes or the poses, or no clip as long as a window.

    Source: Jin, Omens, Geng, Teran, Kumar, Tashiro, Fedkiw, "A Neural-Network-Based Approach for Loose-Fitting
        Clothing", 2024, Section 10 (constants from ground truth, future work there). Differs: a search without
        derivatives; lengths from the bones' own spans, since ropes of the cloth's 99th percentile would hang lower than
        the cloth does.
    """
    windows = _windows(ropes, shaped, clips, window_seconds, window_count)
    ropes = _with_clearances(ropes, shaped, clips)
    lengths = [ropes, *(_with_lengths(ropes, clips, percentile) for percentile in _LENGTHS)]
    errors = [_cost(each, windows) for each in lengths]
    ropes, error = lengths[int(np.argmin(errors))], min(errors)
    limits = _limits(ropes.constants.substep)
    best, tries, most = ropes.constants, 0, len(_STEPS) * _ROUNDS * 2 * len(limits)
    for step, _ in itertools.product(_STEPS, range(_ROUNDS)):
        for name, limit in limits.items():
            for factor in (step, 1 / step):
                tried = _moved(best, name, factor, limit)
                tries += 1
                found = _cost(ropes.with_constants(tried), windows) if tried != best else math.inf
                if progress is not None:
                    progress("ropes", tries, most)
                if found < error:
                    best, error = tried, found
                    break
    return ropes.with_constants(best)


def _with_clearances(ropes: Ropes, shaped: "ShapedBody", clips: Sequence[Clip]) -> Ropes:
    distances = []
    for motion, bones in clips:
        for frame in range(0, len(motion), 5):
            distances.append(ropes.proxy.distances(bones[frame], shaped.posed(motion[frame]).transforms)[0])
    lowest = np.percentile(distances, _CLEARANCE, axis=0)
    return replace(ropes, chains=replace(ropes.chains, clearances=np.minimum(lowest, ropes.chains.clearances)))


def _with_lengths(ropes: Ropes, clips: Sequence[Clip], percentile: float) -> Ropes:
    free = np.flatnonzero(ropes.parents >= 0)
    spans = np.concatenate([np.linalg.norm(bones[:, free] - bones[:, free - 1], axis=2) for _, bones in clips])
    lengths = ropes.lengths.copy()
    lengths[free] = np.maximum(np.percentile(spans, percentile, axis=0), 0.5 * lengths[free])
    return replace(ropes, chains=replace(ropes.chains, lengths=lengths))


def bone_error_mm(
    ropes: Ropes, shaped: "ShapedBody", clips: Sequence[Clip], *, window_seconds: float = 1.0, window_count: int = 12
) -> float:
    """Mean distance of swinging bones to the ground truth, over windows that start from it [mm].

    Args:
        ropes: Bones and constants.
        shaped: The body of the clips.
        clips: Poses and simulated bones.
        window_seconds: Length of a window [s].
        window_count: Windows, spread evenly over all clips.

    Raises:
        BadDataset: As for `calibrated`.
    """
    windows = _windows(ropes, shaped, clips, window_seconds, window_count)
    return 1000 * float(np.mean([np.linalg.norm(each, axis=2).mean() for each, _ in _misses(ropes, windows)]))


Window = tuple["list[PosedBody]", np.ndarray, float]


def _windows(ropes: Ropes, shaped: "ShapedBody", clips: Sequence[Clip], seconds: float, count: int) -> list[Window]:
    starts = []
    for clip, (motion, bones) in enumerate(clips):
        if bones.shape != (len(motion), ropes.node_count, 3):
            what = f"bones of clip {clip} must be ({len(motion)}, {ropes.node_count}, 3)"
            raise BadDataset(what, bones.shape, "take them from these ropes: `ropes.embedded(vertices)`")
        length = max(2, round(seconds * motion.fps))
        starts += [(clip, first, length) for first in range(0, len(motion) - length - 1, length)]
    if not starts:
        raise BadDataset("ropes are fitted on windows of a clip", f"no clip of {seconds} s", "simulate a longer clip")
    chosen = np.unique(np.linspace(0, len(starts) - 1, min(count, len(starts))).round().astype(int))
    windows = []
    for clip, first, length in (starts[index] for index in chosen):
        motion, bones = clips[clip]
        frames = range(first, first + length + 2)
        windows.append(
            ([shaped.posed(motion[frame]) for frame in frames], bones[frames.start : frames.stop], 1 / motion.fps)
        )
    return windows


def _cost(ropes: Ropes, windows: list[Window]) -> float:
    """Mean distance to the ground truth, plus the mean distance of third differences over `_TREMBLE` seconds [m]."""
    costs = []
    for miss, dt in _misses(ropes, windows):
        trembling = np.diff(miss, 3, axis=0) * (_TREMBLE / dt) ** 3
        costs.append(sum(np.linalg.norm(each, axis=2).mean() for each in (miss, trembling) if len(each)))
    return float(np.mean(costs))


def _misses(ropes: Ropes, windows: list[Window]) -> Iterator[tuple[Float[np.ndarray, "frames free 3"], float]]:
    """How far the free bones are off in each window, frame by frame [m], and the time between frames [s]."""
    free = ropes.parents >= 0
    for bodies, bones, dt in windows:
        state, miss = _begun(ropes, bodies, bones, dt), []
        for body, truth in zip(bodies[2:], bones[2:], strict=True):
            state = ropes.step(state, body, dt)
            miss.append(state.positions[free] - truth[free])
        yield np.stack(miss), dt


def _begun(ropes: Ropes, bodies: "list[PosedBody]", bones: np.ndarray, dt: float) -> RopesState:
    """The ground truth at the second frame, with velocities from its neighbours."""
    kinematic, state = ropes.kinematic, ropes.start(bodies[1])
    before, now, after = (ropes.carried(body) for body in bodies[:3])
    positions, velocities = np.array(bones[1], np.float64), (bones[2] - bones[0]) / (2 * dt)
    positions[kinematic], velocities[kinematic] = now, (after - before) / (2 * dt)
    return replace(
        state,
        positions=positions,
        velocities=velocities,
        kinematic_velocities=velocities[kinematic],
        kinematic_rates=(now - before) / dt,
        last_dt=np.asarray(dt),
    )


def _limits(substep: float) -> dict[str, float]:
    """Largest values: springs half way to what the longest substep can follow, damping within two of them."""
    springs = {
        "lateral": LATERAL_BOUND,
        "lateral_stretch": LATERAL_BOUND,
        "shrink": SHRINK_BOUND,
        "rest_angle": REST_ANGLE_BOUND,
    }
    damping = {"drag": 0.5 / substep, "air_drag": 20.0, "air_lift": 20.0, "parent_damping": 0.5 / substep}
    return damping | {"friction": 1.0} | {name: bound / substep**2 for name, bound in springs.items()}


def _moved(constants: RopeConstants, name: str, factor: float, limit: float) -> RopeConstants:
    value = max(getattr(constants, name), _SMALLEST) * factor
    return replace(constants, **{name: 0.0 if value < _SMALLEST else min(value, limit)})
