"""The rim that a garment hangs from."""

import numpy as np

from hemline.arrays import Faces, Int, Vertices
from hemline.meshes import open_rims

TALLEST_RIM = 0.25
"""Height of the tallest rim that is an opening around waist or neck; a taller one also runs down a front [m]."""
UPPER_PART = 0.1
"""Height of the upper part of a taller rim [m]."""


def upper_rim(vertices: Vertices, faces: Faces) -> Int[np.ndarray, " rim"]:
    """Returns the rim that reaches highest, in order; of one that also runs far down, such as a cape's, the upper part.

    A waistband, a neckline and the face opening of a hood are whole rims. The rim of an open jacket or a cape runs on
    along its fronts and its hem, which hang free.

    Args:
        vertices: Positions on the body at rest [m].
        faces: Triangles.

    Returns:
        Vertex ids, int32; empty for a closed mesh.
    """
    loops = open_rims(faces)
    if not loops:
        return np.empty(0, np.int32)
    loop = max(loops, key=lambda each: (float(vertices[each, 1].max()), float(vertices[each, 1].mean())))
    heights = vertices[loop, 1]
    if np.ptp(heights) <= TALLEST_RIM:
        return loop
    high = heights > heights.max() - UPPER_PART
    # the loop is turned so that it begins where the upper part begins
    starts = np.flatnonzero(high & ~np.roll(high, 1))
    first = int(starts[0]) if len(starts) else 0
    return np.roll(loop, -first)[np.roll(high, -first)]
