"""Gradient descent on the constants of the ropes, by the error of their trajectories with contact."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
import torch

from hemline.animators.ropes.bones.chains import Ropes
from hemline.animators.ropes.mechanics.constants import RopeConstants
from hemline.animators.ropes.mechanics.state import RopesState
from hemline.arrays import Float
from hemline.collide.primitives.body_primitives import Colliders

from .differentiable import Drive, trajectory

Window = tuple[RopesState, Sequence[np.ndarray], Float[np.ndarray, "frames nodes 3"]]
"""Start of a window, skin transforms of the body in the frames after it, and the simulated bones in them [m]."""
TRAJECTORY_FRAMES = 20
"""Number of frames of the trajectories; through longer ones gradients grow without more information."""
LEARNING_RATE, REPORT_INTERVAL = 0.15, 4
"""Learning rate of Adam on the logarithms of the constants, and the number of steps between reported constants."""


def descend(
    ropes: Ropes,
    windows: Sequence[Window],
    dt: float,
    limits: Mapping[str, float],
    *,
    steps: int,
    smallest: float,
    tremble: float,
) -> Iterator[RopeConstants]:
    """Yields constants during the descent, every few steps.

    The error of a window is the mean distance of the free bones to the simulated ones, and as much again of the third
    differences of that; the geometric mean of the windows counts, as in `calibrate.calibrate`.

    Args:
        ropes: The bones, and the constants to begin with.
        windows: Starts, motion of the body and simulated bones; at least 4 frames each.
        dt: Time between frames [s].
        limits: Names of the constants to fit, with their largest values.
        steps: Number of steps of Adam.
        smallest: Start of a constant that is zero.
        tremble: Time scale of the trembling that counts as an error [s].
    """
    drive, starts, target, colliders = _window_drive(ropes, windows, dt)
    chains, first = ropes.chains, int(ropes.chains.offsets[0])
    free = torch.as_tensor(chains.parents[first:] >= 0)
    logs = {
        name: torch.tensor(math.log(min(max(getattr(chains.constants, name), smallest), limit)), dtype=torch.float64)
        for name, limit in limits.items()
    }
    for each in logs.values():
        each.requires_grad_()
    adam = torch.optim.Adam(list(logs.values()), lr=LEARNING_RATE)
    for step in range(1, steps + 1):
        values = {name: each.clamp(max=math.log(limits[name])).exp() for name, each in logs.items()}
        miss = (trajectory(chains, drive, *starts, values, colliders) - target)[:, :, free]
        trembling = miss.diff(3, dim=1) * (tremble / dt) ** 3
        errors = _mean_length(miss) + _mean_length(trembling)
        adam.zero_grad()
        torch.log(errors).mean().backward()
        adam.step()
        if step % REPORT_INTERVAL == 0 or step == steps:
            fitted = {name: min(math.exp(float(each.detach())), limits[name]) for name, each in logs.items()}
            yield replace(chains.constants, **fitted)


def _mean_length(values: torch.Tensor) -> torch.Tensor:
    """Returns the mean length of vectors in each window."""
    return (values.square().sum(-1) + 1e-18).sqrt().mean(dim=(1, 2))


def _window_drive(
    ropes: Ropes, windows: Sequence[Window], dt: float
) -> tuple[Drive, tuple[np.ndarray, np.ndarray], torch.Tensor, Colliders]:
    """Returns the drive of all windows, the start and the target of the bones, and the colliders."""
    kinematic, motions, poses = ropes.kinematic, [], []
    count = min(TRAJECTORY_FRAMES, *(len(bodies) for _, bodies, _ in windows))
    for state, bodies, _ in windows:
        window_motions, window_poses = [], [state.frames]
        for frames in bodies[:count]:
            motion = ropes.kinematic_motion(state, frames, dt)
            positions = state.positions.copy()
            positions[kinematic] = motion[1]
            rates = (motion[1] - motion[0]) / dt
            state = replace(
                state,
                positions=positions,
                frames=frames,
                kinematic_velocities=motion[3],
                kinematic_rates=rates,
                last_dt=np.asarray(dt),
            )
            window_motions.append(motion)
            window_poses.append(frames)
        motions.append(np.stack(window_motions))
        poses.append(np.stack(window_poses))
    one, chains = windows[0][0], ropes.chains
    steps = chains.substeps(dt, 0.0)
    drive = Drive.of(chains, np.stack(motions), np.stack(poses), one.pivots, dt, steps)
    positions, velocities = (
        np.stack([getattr(each[0], name) for each in windows]) for name in ("positions", "velocities")
    )
    starts = positions, velocities
    target = np.stack([bones[:count, int(chains.offsets[0]) :] for _, _, bones in windows])
    colliders = Colliders(ropes.primitives.kinds, ropes.primitives.joints, one.shapes, one.centres, one.pivots)
    return drive, starts, torch.as_tensor(target), colliders
