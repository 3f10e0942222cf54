"""Positions of bones on a given mesh: simulated bones are embedded in it, the others are carried by the body."""

import numpy as np

from hemline.arrays import Nodes, Vertices
from hemline.bodies.body import PosedBody, ShapedBody

from .chains import Ropes


def bones_of_mesh(ropes: Ropes, vertices: Vertices, posed: PosedBody) -> Nodes:
    """Returns the positions of all bones of a garment whose vertices are given [m], float64.

    Bones that the body carries are taken from the body, as during playback, so that the networks see the same inputs
    in training and in playback.

    Source: Jin, Omens, Geng, Teran, Kumar, Tashiro, Fedkiw, "A Neural-Network-Based Approach for Loose-Fitting
        Clothing", 2024, Section 7 (bones "barycentrically enslaved" to the simulation).
    """
    bones = np.array(ropes.positions_on(vertices), np.float64)
    bones[ropes.kinematic] = ropes.kinematic_positions(posed)
    return bones


def rest_bones(ropes: Ropes, rest: Vertices, shaped: ShapedBody) -> Nodes:
    """Returns the positions of all bones in the rest drape on a body in its rest pose [m], float64."""
    return bones_of_mesh(ropes, rest, shaped.posed(shaped.rest_pose))
