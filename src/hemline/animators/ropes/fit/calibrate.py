"""Fit of the constants of rope chains to simulated bones, so that they swing like the cloth."""

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from hemline.animators.ropes.bones.chains import Ropes
from hemline.animators.ropes.mechanics.constants import RopeConstants
from hemline.animators.ropes.mechanics.rope_force_kernels import LATERAL_BOUND, REST_ANGLE_BOUND, SHRINK_BOUND
from hemline.animators.ropes.mechanics.state import RopesState
from hemline.arrays import Float
from hemline.errors import BadDataset
from hemline.motions import Motion

if TYPE_CHECKING:
    from hemline.bodies import PosedBody, ShapedBody

Clip = tuple[Motion, Float[np.ndarray, "frames nodes 3"]]
"""The poses of a clip, and all bones on the simulated garment in each (`Ropes.positions_on`) [m]."""

_SEARCH_FACTORS = (2.0, 1.4)
_SEARCH_ROUNDS = 2
_SMALLEST_CONSTANT = 0.05
_TREMBLE_SECONDS = 1 / 30
"""Time scale of the trembling that counts as an error [s]."""
_STANDING_SECONDS, _SHOVE_SPEED = 3.0, 0.5
"""Time that ropes stand still to come back to rest [s], after a shove of this speed at each bone and axis [m/s]."""


def calibrate(
    ropes: Ropes,
    shaped: "ShapedBody",
    clips: Sequence[Clip],
    *,
    window_seconds: float = 1.3,
    window_count: int = 36,
    progress: Callable[[str, int, int], None] | None = None,
) -> Ropes:
    """Returns the ropes with the constants that bring them closest to simulated bones.

    A compass search over springs and damping multiplies and divides each constant by a factor, keeps what helps, and
    shrinks the factor. Air and friction are those of the material (`RopeConstants.of_material`) and stay: fitted, they
    would make up for other errors in the windows and be wrong at other speeds. Some of the windows are those in which
    the body moves fastest. The error of a window that starts from the ground truth is the distance to it plus the error
    of the trembling; otherwise ropes that shake around the right place would win. The geometric mean over the windows
    counts; otherwise the few windows of the wildest clips, which no constants bring near, would decide alone. Added is
    the error of ropes that were shoved and have stood still since, against the settled drape. Lengths and clearances
    are those of the drape: ropes as long as the simulated spans would hang differently, and bones with the clearances
    of simulated ones would lie inside the body, since the primitives are not exactly the body.

    Args:
        ropes: Ropes built on the garment that was simulated, and the constants to begin with.
        shaped: The body of the clips.
        clips: Poses and simulated bones, frame by frame.
        window_seconds: Length of a window [s].
        window_count: Number of windows. Two thirds of them are spread evenly over all clips; the others are those in
            which the body moves farthest.
        progress: Called with "ropes", tries done and the largest number of tries.

    Returns:
        Ropes whose springs and damping are below what the longest substep can follow.

    Raises:
        BadDataset: Bones do not fit the ropes or the poses, or no clip is as long as a window.

    Source: Jin, Omens, Geng, Teran, Kumar, Tashiro, Fedkiw, "A Neural-Network-Based Approach for Loose-Fitting
        Clothing", 2024, Section 10 (constants from ground truth by differentiable ropes, future work there).
        Differs: a search without derivatives.
    """
    windows, standing = _windows(ropes, shaped, clips, window_seconds, window_count), shaped.posed(shaped.rest_pose)
    error = _cost(ropes, windows, standing)
    limits = _limits(ropes.constants.substep)
    best, tries, total = ropes.constants, 0, len(_SEARCH_FACTORS) * _SEARCH_ROUNDS * 2 * len(limits)
    for step, _ in itertools.product(_SEARCH_FACTORS, range(_SEARCH_ROUNDS)):
        for name, limit in limits.items():
            for factor in (step, 1 / step):
                candidate = _scale_constant(best, name, factor, limit)
                tries += 1
                found = _cost(ropes.with_constants(candidate), windows, standing) if candidate != best else math.inf
                if progress is not None:
                    progress("ropes", tries, total)
                if found < error:
                    best, error = candidate, found
                    break
    return ropes.with_constants(best)


def bone_error_mm(
    ropes: Ropes, shaped: "ShapedBody", clips: Sequence[Clip], *, window_seconds: float = 1.3, window_count: int = 36
) -> float:
    """Returns the mean distance of swinging bones to the ground truth, over windows that start from it [mm].

    Args:
        ropes: Bones and constants.
        shaped: The body of the clips.
        clips: Poses and simulated bones.
        window_seconds: Length of a window [s].
        window_count: Number of windows, chosen as for `calibrate`.

    Raises:
        BadDataset: Bones do not fit the ropes or the poses, or no clip is as long as a window.
    """
    windows = _windows(ropes, shaped, clips, window_seconds, window_count)
    return 1000 * float(np.mean([np.linalg.norm(each, axis=2).mean() for each, _ in _bone_errors(ropes, windows)]))


Window = tuple["list[PosedBody]", np.ndarray, float]


def _windows(ropes: Ropes, shaped: "ShapedBody", clips: Sequence[Clip], seconds: float, count: int) -> list[Window]:
    starts = []
    for clip, (motion, bones) in enumerate(clips):
        if bones.shape != (len(motion), ropes.node_count, 3):
            what = f"bones of clip {clip} must be ({len(motion)}, {ropes.node_count}, 3)"
            raise BadDataset(what, bones.shape, "take them from these ropes: `ropes.positions_on(vertices)`")
        length = max(2, round(seconds * motion.fps))
        starts += [(clip, first, length) for first in range(0, len(motion) - length - 1, length)]
    if not starts:
        raise BadDataset("ropes are fitted on windows of a clip", f"no clip of {seconds} s", "simulate a longer clip")
    fast = count // 3
    ways = [
        float(np.linalg.norm(clips[clip][0].translations[first + length] - clips[clip][0].translations[first]))
        for clip, first, length in starts
    ]
    evenly = np.linspace(0, len(starts) - 1, min(count - fast, len(starts))).round().astype(int)
    chosen = np.union1d(evenly, np.argsort(ways)[::-1][:fast])
    windows = []
    for clip, first, length in (starts[index] for index in chosen):
        motion, bones = clips[clip]
        frames = range(first, first + length + 2)
        windows.append(
            ([shaped.posed(motion[frame]) for frame in frames], bones[frames.start : frames.stop], 1 / motion.fps)
        )
    return windows


def _cost(ropes: Ropes, windows: list[Window], standing: "PosedBody") -> float:
    """Returns the error of the ropes: geometric mean over the windows, plus the error of standing still [m]."""
    costs = [_window_error(miss, dt) for miss, dt in _bone_errors(ropes, windows)]
    return math.exp(np.mean(np.log(costs))) + _standing_error(ropes, standing)


def _window_error(miss: Float[np.ndarray, "frames free 3"], dt: float) -> float:
    """Returns the mean distance, plus that of third differences over `_TREMBLE_SECONDS` [m]."""
    trembling = np.diff(miss, 3, axis=0) * (_TREMBLE_SECONDS / dt) ** 3
    return sum(float(np.linalg.norm(each, axis=2).mean()) for each in (miss, trembling) if len(each))


def _standing_error(ropes: Ropes, standing: "PosedBody") -> float:
    """Returns the error against the settled drape in the last second of standing still after a shove [m]."""
    state, free, dt = ropes.start(standing), ropes.parents >= 0, _TREMBLE_SECONDS
    drape, away = state.positions, []
    shove = np.random.default_rng(0).normal(0, _SHOVE_SPEED, drape.shape) * free[:, None]
    state = replace(state, velocities=shove)
    for _ in range(round(_STANDING_SECONDS / dt)):
        state = ropes.step(state, standing, dt)
        away.append((state.positions - drape)[free])
    return _window_error(np.stack(away[-round(1 / dt) :]), dt)


def _bone_errors(ropes: Ropes, windows: list[Window]) -> Iterator[tuple[Float[np.ndarray, "frames free 3"], float]]:
    """Yields the errors of the free bones in each window [m], and the time between frames [s]."""
    free = ropes.parents >= 0
    for bodies, bones, dt in windows:
        state, miss = _start_window(ropes, bodies, bones, dt), []
        for body, truth in zip(bodies[2:], bones[2:], strict=True):
            state = ropes.step(state, body, dt)
            miss.append(state.positions[free] - truth[free])
        yield np.stack(miss), dt


def _start_window(ropes: Ropes, bodies: "list[PosedBody]", bones: np.ndarray, dt: float) -> RopesState:
    """Returns the ground truth at the second frame, with velocities from its neighbours."""
    kinematic, state = ropes.kinematic, ropes.start(bodies[1])
    before, now, after = (ropes.kinematic_positions(body) for body in bodies[:3])
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
    """Returns the largest values: springs halfway to what the longest substep can follow, damping within two."""
    springs = {
        "lateral": LATERAL_BOUND,
        "lateral_stretch": LATERAL_BOUND,
        "shrink": SHRINK_BOUND,
        "rest_angle": REST_ANGLE_BOUND,
    }
    damping = {"parent_damping": 0.5 / substep}
    damping |= {"root_damping": 1000.0, "bend_damping": 1000.0, "lateral_damping": 1000.0}
    return damping | {name: bound / substep**2 for name, bound in springs.items()}


def _scale_constant(constants: RopeConstants, name: str, factor: float, limit: float) -> RopeConstants:
    value = max(getattr(constants, name), _SMALLEST_CONSTANT) * factor
    return replace(constants, **{name: 0.0 if value < _SMALLEST_CONSTANT else min(value, limit)})
