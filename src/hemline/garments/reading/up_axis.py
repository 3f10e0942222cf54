"""Which axis points up in a garment's file."""

import numpy as np

from hemline.arrays import Vertices

AXES = ("y", "z")
"""Axes that may point up; the first is hemline's own."""

BETTER = 0.67
"""z is taken to point up where the garment's misfit with the body is less than so many times that with y up."""

TURNED = "up: z, as it fits the body so; it was turned to y up"
"""What is said where that was guessed."""


def stood_up(vertices: Vertices, axis: str) -> Vertices:
    """Positions with y up.

    Args:
        vertices: Positions with `axis` up; z up, the front is towards -y, as in Blender.
        axis: One of `AXES`.
    """
    return np.ascontiguousarray(vertices[:, [0, 2, 1]] * (1, 1, -1)) if axis == "z" else vertices
