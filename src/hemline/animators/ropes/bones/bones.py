"""The bones that a mesh shows: simulated ones embedded in it, the others where the body carries them."""

import numpy as np

from hemline.arrays import Float, Nodes, Vertices
from hemline.bodies.body import PosedBody, ShapedBody

from .chains import Ropes


def seen_bones(ropes: Ropes, vertices: Vertices, posed: PosedBody) -> Nodes:
    """Positions of all bones of a garment whose vertices are given [m], float64.

    Bones that the body carries are taken from the body, as when the garment is played: the networks learn and play
    with the same inputs there.

    Source: Jin, Omens, Geng, Teran, Kumar, Tashiro, Fedkiw, "A Neural-Network-Based Approach for Loose-Fitting
        Clothing", 2024, Section 7 (bones "barycentrically enslaved" to the simulation).
    """
    bones = np.array(ropes.embedded(vertices), np.float64)
    bones[ropes.kinematic] = ropes.carried(posed)
    return bones


def rest_bones(ropes: Ropes, rest: Vertices, shaped: ShapedBody) -> Nodes:
    """Positions of all bones in the rest drape on a body in its rest pose [m], float64."""
    return seen_bones(ropes, rest, shaped.posed(shaped.rest_pose))


def margins_of(ropes: Ropes, clearance: float) -> Float[np.ndarray, " free"]:
    """Distance that each free bone keeps from the body's primitives: less than asked where it is nearer at rest [m]."""
    return np.minimum(clearance, ropes.chains.clearances[ropes.parents >= 0])
