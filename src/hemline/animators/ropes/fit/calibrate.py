"""Fit the constants of rope chains to simulated bones, so that they swing as the cloth does."""

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
"""The poses of a clip, and all bones on the simulated garment in each (`Ropes.embedded`) [m]."""

_STEPS = (2.0, 1.4)
_ROUNDS = 2
_SMALLEST = 0.05
_TREMBLE = 1 / 30
"""What trembles within this time is an error [s]."""
_STAND, _SHOVE = 3.0, 0.5
"""So long ropes stand still [s] after a shove of this speed at each bone and axis [m/s], and are to be back by then."""


def calibrated(
    ropes: Ropes,
    shaped: "ShapedBody",
    clips: Sequence[Clip],
    *,
    window_seconds: float = 2.0,
    window_count: int = 36,
    gradient_steps: int = 0,
    progress: Callable[[str, int, int], None] | None = None,
) -> Ropes:
    """The same bones on constants that bring them closest to simulated ones.

    A compass search over drag, springs, damping and friction: each is multiplied and divided by a step, what helps is
    kept, the step shrinks. From what it finds, the gradient of trajectories may lead on (`descend.descended`), where
    that helps; friction, for which they have none, stays. The error is the distance to the ground truth over windows
    that start from it, and as much again of how far the trembling is off: without that, ropes that shake around the
    right place would be the best. Its geometric mean counts: else the few windows of the wildest clips, which no
    constants bring near, would decide alone. To it comes how far ropes are from the settled drape that were shoved and
    have stood still since, and how they tremble there. Lengths and clearances are those of the drape and stay: ropes as
    long as the simulated spans would not hang as it does, and bones that may come as near to the body's primitives as
    simulated ones did come to lie inside the body, which is not where the primitives are.

    Args:
        ropes: Bones laid on the garment that was simulated, and the constants to begin with.
        shaped: The body of the clips.
        clips: Poses and simulated bones, frame by frame.
        window_seconds: Length of a window [s].
        window_count: Windows, spread evenly over all clips.
        gradient_steps: Steps along the gradient after the search; they need torch.
        progress: Called with "ropes", tries done and most tries.

    Returns:
        Ropes whose springs and damping are below what the longest substep can follow.

    Raises:
        BadDataset: Bones that do not fit the ropes or the poses, or no clip as long as a window.

    Source: Jin, Omens, Geng, Teran, Kumar, Tashiro, Fedkiw, "A Neural-Network-Based Approach for Loose-Fitting
        Clothing", 2024, Section 10 (constants from ground truth by differentiable ropes, future work there).
        Differs: a search without derivatives comes first.
    """
    windows, standing = _windows(ropes, shaped, clips, window_seconds, window_count), shaped.posed(shaped.rest_pose)
    error = _cost(ropes, windows, standing)
    limits = _limits(ropes.constants.substep)
    best, tries, most = ropes.constants, 0, len(_STEPS) * _ROUNDS * 2 * len(limits)
    for step, _ in itertools.product(_STEPS, range(_ROUNDS)):
        for name, limit in limits.items():
            for factor in (step, 1 / step):
                tried = _moved(best, name, factor, limit)
                tries += 1
                found = _cost(ropes.with_constants(tried), windows, standing) if tried != best else math.inf
                if progress is not None:
                    progress("ropes", tries, most)
                if found < error:
                    best, error = tried, found
                    break
    for tried in _descended(ropes.with_constants(best), windows, limits, gradient_steps) if gradient_steps else ():
        found = _cost(ropes.with_constants(tried), windows, standing)
        if found < error:
            best, error = tried, found
    return ropes.with_constants(best)


def bone_error_mm(
    ropes: Ropes, shaped: "ShapedBody", clips: Sequence[Clip], *, window_seconds: float = 2.0, window_count: int = 36
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


def _descended(ropes: Ropes, windows: list[Window], limits: dict[str, float], steps: int) -> Iterator[RopeConstants]:
    """Constants down the gradient, of the windows that are as long as most are."""
    from hemline.animators.ropes.fit.gradient.descend import descended

    dt = windows[0][2]
    begun = [
        (_begun(ropes, bodies, bones, dt), [ropes.proxy.posed(body) for body in bodies[2:]], bones[2:])
        for bodies, bones, each in windows
        if each == dt
    ]
    smooth = {name: limit for name, limit in limits.items() if name != "friction"}
    return descended(ropes, begun, dt, smooth, steps=steps, smallest=_SMALLEST, tremble=_TREMBLE)


def _cost(ropes: Ropes, windows: list[Window], standing: "PosedBody") -> float:
    """Distance to the truth, and of third differences over `_TREMBLE` seconds: geometric mean of the windows [m]."""
    costs = [_off(miss, dt) for miss, dt in _misses(ropes, windows)]
    return math.exp(np.mean(np.log(costs))) + _unrest(ropes, standing)


def _off(miss: Float[np.ndarray, "frames free 3"], dt: float) -> float:
    trembling = np.diff(miss, 3, axis=0) * (_TREMBLE / dt) ** 3
    return sum(float(np.linalg.norm(each, axis=2).mean()) for each in (miss, trembling) if len(each))


def _unrest(ropes: Ropes, standing: "PosedBody") -> float:
    """The same against the settled drape, in the last second of standing still after a shove [m]."""
    state, free, dt = ropes.start(standing), ropes.parents >= 0, _TREMBLE
    drape, away = state.positions, []
    shove = np.random.default_rng(0).normal(0, _SHOVE, drape.shape) * free[:, None]
    state = replace(state, velocities=shove)
    for _ in range(round(_STAND / dt)):
        state = ropes.step(state, standing, dt)
        away.append((state.positions - drape)[free])
    return _off(np.stack(away[-round(1 / dt) :]), dt)


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
    damping |= {"root_damping": 1000.0, "bend_damping": 1000.0, "lateral_damping": 1000.0}
    return damping | {"friction": 1.0} | {name: bound / substep**2 for name, bound in springs.items()}


def _moved(constants: RopeConstants, name: str, factor: float, limit: float) -> RopeConstants:
    value = max(getattr(constants, name), _SMALLEST) * factor
    return replace(constants, **{name: 0.0 if value < _SMALLEST else min(value, limit)})
