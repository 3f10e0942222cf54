"""Chains on their own, without a garment: stepped with pinned roots."""

import numpy as np

from hemline.animators.ropes.mechanics.dynamics import RopeChains
from hemline.collide.primitives.body_primitives import BodyPrimitives

QUIET = dict.fromkeys(
    ("drag", "air_drag", "air_lift", "lateral", "lateral_stretch", "shrink", "parent_damping", "root_damping",
     "bend_damping", "lateral_damping", "friction"), 0.0
)  # fmt: skip
"""Gravity alone."""
GRAVITY = 9.81


def simulate_chains(
    chains: RopeChains, start, dt: float, count: int, *, primitives: BodyPrimitives | None = None, frames=None
):
    """Positions and velocities (count + 1, nodes, 3) of chains whose roots stand still.

    Args:
        chains: The chains.
        start: Positions [m].
        dt: Length of a step [s].
        count: Steps.
        primitives: What they collide with.
        frames: Its transforms at a time [s]; None: it stands still.
    """
    primitives = primitives or BodyPrimitives.none()
    frames = frames or (lambda t: np.tile(np.eye(4)[:3], (len(primitives.pivots), 1, 1)))
    x, v, tensions = np.array(start, float), np.zeros(np.shape(start)), np.zeros(len(start))
    roots = x[chains.kinematic]
    motion = np.stack([roots, roots, 0 * roots, 0 * roots])
    path, speeds = [x], [v]
    for k in range(count):
        ends = frames(k * dt), frames((k + 1) * dt)
        x, v, tensions, _ = chains.advance(x, v, tensions, motion, dt, colliders=primitives.colliders, frames=ends)
        path.append(x)
        speeds.append(v)
    return np.stack(path), np.stack(speeds)
