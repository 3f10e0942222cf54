"""Compiled: triangles of cloth are moved out over the vertices of the body that they cover."""

import math
from typing import NamedTuple

import numpy as np

from hemline.arrays import Int
from hemline.compiled import kernel

_index = np.uintp
BEHIND_RATIO = np.float32(1.001)
"""A vertex of the body is surely behind a triangle, whatever the rounding, from this multiple of the squared gap on."""
LEAST_AREA = np.float32(1e-22)
"""A triangle whose doubled area, squared, is below this covers nothing [m^4]."""


class CoveredSkin(NamedTuple):
    """Vertices of the body that a garment covers at rest, and how its triangles are connected."""

    points: Int[np.ndarray, " points"]
    """Vertices of the body."""
    over: Int[np.ndarray, " points"]
    """The triangle over each of them at rest."""
    corners: Int[np.ndarray, "faces 3"]
    """Triangles of the garment."""
    beyond: Int[np.ndarray, "faces 3"]
    """The triangle across the edge opposite each corner, -1 on a rim."""


@kernel
def cover_points(covered, skin, idle, gap, deepest, steps, sweeps, vertices_out):
    """Moves triangles out until the points that they cover are a gap behind them.

    For each point a walk leads from the triangle over it at rest, across the edges that the point is beyond, to the
    triangle over it now. With the depth d of the point along the unit normal and its barycentric weights w, corner i
    moves by w_i / (sum w^2) times what d lacks. A point is visited again only where a corner has moved since.

    Reads: covered; skin (body_verts, 3) [m]; idle (verts,): a triangle with such a corner covers nothing; gap: distance
        of a covered point behind the triangle [m]; deepest: a point farther in front is not covered by the triangle
        [m]; steps: triangles of a walk, at most; sweeps.
    Writes: vertices_out (verts, 3): the garment [m].
    Returns: how often a triangle was moved.
    """
    points, over, corners, beyond = covered.points, covered.over, covered.corners, covered.beyond
    moved, clock, behind = 0, 0, BEHIND_RATIO * gap * gap
    moved_at, visited_at = np.zeros(len(vertices_out), np.int64), np.full(len(points), -1, np.int64)
    here = over.copy()
    for _ in range(sweeps):
        before = moved
        for point in range(len(points)):
            i = _index(point)
            t, previous = _index(here[i]), np.int32(-1)
            a, b, c = _index(corners[t, 0]), _index(corners[t, 1]), _index(corners[t, 2])
            if max(moved_at[a], moved_at[b], moved_at[c]) <= visited_at[i]:
                continue
            visited_at[i] = clock
            p, found = _index(points[i]), False
            ax = ay = az = px = py = pz = square = first = second = third = vertices_out[a, 0]
            for _step in range(steps):
                a, b, c = _index(corners[t, 0]), _index(corners[t, 1]), _index(corners[t, 2])
                x, y, z = vertices_out[a, 0], vertices_out[a, 1], vertices_out[a, 2]
                ux, uy, uz = vertices_out[b, 0] - x, vertices_out[b, 1] - y, vertices_out[b, 2] - z
                vx, vy, vz = vertices_out[c, 0] - x, vertices_out[c, 1] - y, vertices_out[c, 2] - z
                ax, ay, az = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
                square = ax * ax + ay * ay + az * az
                px, py, pz = skin[p, 0] - x, skin[p, 1] - y, skin[p, 2] - z
                second = (py * vz - pz * vy) * ax + (pz * vx - px * vz) * ay + (px * vy - py * vx) * az
                third = (uy * pz - uz * py) * ax + (uz * px - ux * pz) * ay + (ux * py - uy * px) * az
                first = square - second - third
                if first >= 0 and second >= 0 and third >= 0:
                    found = True
                    break
                side = 0 if first <= second and first <= third else 1 if second <= third else 2
                following = beyond[t, side]
                # to and fro over a fold: over neither side of it
                if following < 0 or following == previous:
                    break
                previous, t = np.int32(t), _index(following)
            if not found or square < LEAST_AREA or idle[a] or idle[b] or idle[c]:
                continue
            here[i] = np.int32(t)
            high = px * ax + py * ay + pz * az
            if high < 0 and high * high > behind * square:
                continue
            length = math.sqrt(square)
            lack = high / length + gap
            if lack <= 0 or lack > deepest:
                continue
            first, second, third = first / square, second / square, third / square
            step = lack / (first * first + second * second + third * third) / length
            ax, ay, az = step * ax, step * ay, step * az
            vertices_out[a, 0] += first * ax
            vertices_out[a, 1] += first * ay
            vertices_out[a, 2] += first * az
            vertices_out[b, 0] += second * ax
            vertices_out[b, 1] += second * ay
            vertices_out[b, 2] += second * az
            vertices_out[c, 0] += third * ax
            vertices_out[c, 1] += third * ay
            vertices_out[c, 2] += third * az
            moved += 1
            clock += 1
            moved_at[a] = moved_at[b] = moved_at[c] = clock
        if moved == before:
            break
    return moved
