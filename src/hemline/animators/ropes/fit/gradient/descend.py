"""Constants of the ropes by gradient: down the error of their trajectories, contact and all."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
import torch

from hemline.animators.ropes.bones.chains import Ropes
from hemline.animators.ropes.mechanics.constants import RopeConstants
from hemline.animators.ropes.mechanics.state import RopesState
from hemline.arrays import Float
from hemline.collide.primitives.proxy import Colliders

from .differentiable import Drive, trajectory

Begun = tuple[RopesState, Sequence[np.ndarray], Float[np.ndarray, "frames nodes 3"]]
"""Where a window begins, skin transforms of the body in the frames after that, and the simulated bones in them [m]."""
FRAMES = 20
"""Length of the trajectories: through longer ones gradients grow without saying more."""
RATE, SHOWN = 0.15, 4
"""Of Adam on the logarithms of the constants, and after how many steps constants are shown."""


def descended(
    ropes: Ropes,
    windows: Sequence[Begun],
    dt: float,
    limits: Mapping[str, float],
    *,
    steps: int,
    smallest: float,
    tremble: float,
) -> Iterator[RopeConstants]:
    """Constants on the way down the error, every few steps.

    The error of a window is the mean distance of the free bones to the simulated ones, and as much again of the third
    differences of that; the geometric mean of the windows counts, as in `calibrate.calibrated`.

    Args:
        ropes: The bones, and the constants to begin with.
        windows: Where they begin, what the body does, where the bones should be; at least 4 frames each.
        dt: Time between frames [s].
        limits: The constants that are fitted, and their largest values.
        steps: How many steps of Adam.
        smallest: What a constant that is zero begins from.
        tremble: What trembles within this time is an error [s].
    """
    drive, begun, wanted, colliders = _driven(ropes, windows, dt)
    chains, first = ropes.chains, int(ropes.chains.offsets[0])
    free = torch.as_tensor(chains.parents[first:] >= 0)
    logs = {
        name: torch.tensor(math.log(min(max(getattr(chains.constants, name), smallest), limit)), dtype=torch.float64)
        for name, limit in limits.items()
    }
    for each in logs.values():
        each.requires_grad_()
    adam = torch.optim.Adam(list(logs.values()), lr=RATE)
    for step in range(1, steps + 1):
        values = {name: each.clamp(max=math.log(limits[name])).exp() for name, each in logs.items()}
        miss = (trajectory(chains, drive, *begun, values, colliders) - wanted)[:, :, free]
        trembling = miss.diff(3, dim=1) * (tremble / dt) ** 3
        errors = _size(miss) + _size(trembling)
        adam.zero_grad()
        torch.log(errors).mean().backward()
        adam.step()
        if step % SHOWN == 0 or step == steps:
            found = {name: min(math.exp(float(each.detach())), limits[name]) for name, each in logs.items()}
            yield replace(chains.constants, **found)


def _size(values: torch.Tensor) -> torch.Tensor:
    """Mean length of vectors in each window."""
    return (values.square().sum(-1) + 1e-18).sqrt().mean(dim=(1, 2))


def _driven(
    ropes: Ropes, windows: Sequence[Begun], dt: float
) -> tuple[Drive, tuple[np.ndarray, np.ndarray], torch.Tensor, Colliders]:
    """What moves the roots in all windows, where the bones begin, where they should be."""
    kinematic, motions, poses = ropes.kinematic, [], []
    count = min(FRAMES, *(len(bodies) for _, bodies, _ in windows))
    for state, bodies, _ in windows:
        found, seen = [], [state.frames]
        for frames in bodies[:count]:
            motion = ropes.driven(state, frames, dt)
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
            found.append(motion)
            seen.append(frames)
        motions.append(np.stack(found))
        poses.append(np.stack(seen))
    one, chains = windows[0][0], ropes.chains
    steps = chains.substeps(dt, 0.0)
    drive = Drive.of(chains, np.stack(motions), np.stack(poses), one.pivots, dt, steps)
    positions, velocities = (
        np.stack([getattr(each[0], name) for each in windows]) for name in ("positions", "velocities")
    )
    begun = positions, velocities
    wanted = np.stack([bones[:count, int(chains.offsets[0]) :] for _, _, bones in windows])
    colliders = Colliders(ropes.proxy.kinds, ropes.proxy.joints, one.shapes, one.centres, one.pivots)
    return drive, begun, torch.as_tensor(wanted), colliders
