"""Counts the triangles that segments go through."""

import numpy as np

from hemline.arrays import Faces, Float, Int, Vertices

from .segment_crossing_kernels import crossings_of_segments


def segment_crossings(
    segments: Float[np.ndarray, "segments 2 3"], vertices: Vertices, faces: Faces
) -> Int[np.ndarray, " segments"]:
    """Returns how many triangles of a mesh each segment goes through, in float64.

    A segment that ends in a triangle or lies in its plane does not go through it.

    Args:
        segments: Both ends of each segment [m].
        vertices: Positions of the mesh [m].
        faces: Triangles.
    """
    points = np.ascontiguousarray(segments, np.float64).reshape(-1, 3)
    count = np.empty(len(points) // 2, np.int64)
    ends = np.arange(len(points)).reshape(-1, 2)
    crossings_of_segments(
        points, ends, np.ascontiguousarray(vertices, np.float64), np.ascontiguousarray(faces, np.int32), count
    )
    return count
