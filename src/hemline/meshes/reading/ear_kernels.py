"""Compiled: polygons are cut into triangles by clipping ears."""

import numpy as np

from hemline.compiled import kernel


@kernel
def clip_ears(plane, first, corners_out):
    """Cuts polygons into triangles; each polygon of n corners gives n - 2, and every corner stays a corner of one.

    The ear with the largest least angle is clipped first; where a polygon crosses itself and has no ear left, the
    corner with the largest area is clipped.

    Reads: plane (corners, 2): corners of all polygons, each in its own plane, counter-clockwise; first (polygons + 1,):
        first corner of each polygon, and the number of corners.
    Writes: corners_out (triangles, 3): corners of each triangle, counted over all polygons.
    """
    done = 0
    for polygon in range(len(first) - 1):
        low, count = first[polygon], first[polygon + 1] - first[polygon]
        before, after = np.arange(count) - 1, np.arange(count) + 1
        before[0], after[count - 1] = count - 1, 0
        quality = np.empty(count)
        for corner in range(count):
            quality[corner] = _ear_quality(plane, low, before, after, corner)
        left = count
        while left > 3:
            best, start = -1, 0
            for corner in range(count):
                if before[corner] >= 0 and (best < 0 or quality[corner] > quality[best]):
                    best = corner
            one, other = before[best], after[best]
            corners_out[done, 0], corners_out[done, 1], corners_out[done, 2] = low + one, low + best, low + other
            done += 1
            after[one], before[other], before[best] = other, one, -1
            left -= 1
            quality[one] = _ear_quality(plane, low, before, after, one)
            quality[other] = _ear_quality(plane, low, before, after, other)
        start = 0
        while before[start] < 0:
            start += 1
        corners_out[done, 0], corners_out[done, 1] = low + before[start], low + start
        corners_out[done, 2] = low + after[start]
        done += 1


@kernel
def _ear_quality(plane, low, before, after, corner):
    """Measures how well the triangle at a corner of a polygon would be cut off.

    Reads: plane (corners, 2): all corners [m]; low: first corner of the polygon; before, after (corners of the
        polygon,): neighbours of each corner; corner.
    Returns: Twice the area of the triangle over the square of its longest side; if it is no ear, that less 2.
    """
    a, b, c = low + before[corner], low + corner, low + after[corner]
    area = _area(plane, a, b, c)
    longest = max(_square(plane, a, b), _square(plane, b, c), _square(plane, c, a))
    if longest == 0:
        return -4.0
    quality = area / longest
    if quality <= 1e-9:
        return quality - 2
    other = after[after[corner]]
    while other != before[corner]:
        p = low + other
        if (
            _area(plane, a, b, p) >= 0
            and _area(plane, b, c, p) >= 0
            and _area(plane, c, a, p) >= 0
            and _square(plane, p, a) > 0
            and _square(plane, p, b) > 0
            and _square(plane, p, c) > 0
        ):
            return quality - 2
        other = after[other]
    return quality


@kernel
def _area(plane, a, b, c):
    """Computes twice the signed area of a triangle.

    Reads: plane (corners, 2) [m]; a, b, c: its corners.
    Returns: The area [m^2].
    """
    return (plane[b, 0] - plane[a, 0]) * (plane[c, 1] - plane[a, 1]) - (plane[b, 1] - plane[a, 1]) * (
        plane[c, 0] - plane[a, 0]
    )


@kernel
def _square(plane, a, b):
    """Computes the squared distance of two corners.

    Reads: plane (corners, 2) [m]; a, b: the corners.
    Returns: The square [m^2].
    """
    return (plane[b, 0] - plane[a, 0]) ** 2 + (plane[b, 1] - plane[a, 1]) ** 2


__all__ = ["clip_ears"]
