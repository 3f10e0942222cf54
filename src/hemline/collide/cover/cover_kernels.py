"""Compiled: triangles of cloth are moved out over the vertices of the body that they cover."""

import math
from typing import NamedTuple

import numpy as np

from hemline.arrays import Int
from hemline.compiled import kernel

_index = np.uintp
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


class CoverLengths(NamedTuple):
    """Distances by which covered skin is kept behind the cloth, and how far the triangle over it is looked for."""

    gap: np.float32
    """Distance of a covered point behind its triangle [m]."""
    deepest: np.float32
    """A point farther in front of a triangle is not covered by it [m]."""
    steps: int
    """Triangles of a walk from the one that was over a point, at most."""


class CoveredPoints(NamedTuple):
    """The points that are looked at in a frame; `list_covered` writes to both arrays."""

    here: Int[np.ndarray, " points"]
    """The triangle over each point."""
    listed: Int[np.ndarray, " points"]
    """The points that are little behind their triangle or in front of it come first."""


@kernel(forceinline=True)
def height_over_cloth(covered, skin, point, start, steps, vertices):
    """Walks to the triangle over a point, across the edges that the point is beyond, and measures the point there.

    Reads: covered; skin (body_verts, 3) [m]; point: its place in `covered`; start: a triangle; steps: triangles of the
        walk, at most; vertices (verts, 3): the garment [m].
    Returns: The triangle, -1 if the point is beyond a rim, over neither side of a fold, or too far away; the three
        coordinates of the triangle's normal, of any length; the square of that length; the products of that square and
        of the second and third barycentric weight; and that of the length and of the height of the point over the
        triangle.
    """
    corners, beyond, p = covered.corners, covered.beyond, _index(covered.points[point])
    t, previous, nothing = _index(start), np.int32(-1), np.float32(0)
    for _step in range(steps):
        a, b, c = _index(corners[t, 0]), _index(corners[t, 1]), _index(corners[t, 2])
        x, y, z = vertices[a, 0], vertices[a, 1], vertices[a, 2]
        ux, uy, uz = vertices[b, 0] - x, vertices[b, 1] - y, vertices[b, 2] - z
        vx, vy, vz = vertices[c, 0] - x, vertices[c, 1] - y, vertices[c, 2] - z
        ax, ay, az = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        square = ax * ax + ay * ay + az * az
        px, py, pz = skin[p, 0] - x, skin[p, 1] - y, skin[p, 2] - z
        second = (py * vz - pz * vy) * ax + (pz * vx - px * vz) * ay + (px * vy - py * vx) * az
        third = (uy * pz - uz * py) * ax + (uz * px - ux * pz) * ay + (ux * py - uy * px) * az
        first = square - second - third
        if first >= 0 and second >= 0 and third >= 0:
            return np.int32(t), ax, ay, az, square, second, third, px * ax + py * ay + pz * az
        side = 0 if first <= second and first <= third else 1 if second <= third else 2
        following = beyond[t, side]
        # to and fro over a fold: over neither side of it
        if following < 0 or following == previous:
            break
        previous, t = np.int32(t), _index(following)
    return np.int32(-1), nothing, nothing, nothing, nothing, nothing, nothing, nothing


@kernel
def list_covered(covered, skin, lengths, margin, vertices, looked_at):
    """Finds the triangle over each point, and lists the points that are less than a margin behind theirs.

    Reads: covered; skin (body_verts, 3) [m]; lengths: `CoverLengths`; margin [m]; vertices (verts, 3): the garment [m].
    Writes: looked_at: `CoveredPoints`.
    Returns: The number of points that are listed.
    """
    count, limit = 0, margin * margin
    for point in range(len(covered.points)):
        i = _index(point)
        t, _, _, _, square, _, _, high = height_over_cloth(covered, skin, i, covered.over[i], lengths.steps, vertices)
        looked_at.here[i] = t if t >= 0 else covered.over[i]
        looked_at.listed[_index(count)] = point
        count += t >= 0 and (high >= 0 or high * high < limit * square)
    return count


@kernel
def cover_points(covered, skin, idle, lengths, looked_at, count, vertices_out):
    """Moves triangles out until listed points are a gap behind them, once.

    With the height d of a point along the unit normal of the triangle over it and its barycentric weights w, corner i
    moves by w_i / (sum w^2) times what d lacks.

    Reads: covered; skin (body_verts, 3) [m]; idle (verts,): a triangle with such a corner covers nothing; lengths:
        `CoverLengths`; looked_at, count: points that `list_covered` listed.
    Writes: vertices_out (verts, 3): the garment [m]; looked_at: the triangle over each listed point.
    Returns: how often a triangle was moved.
    """
    moved, corners, out = 0, covered.corners, vertices_out
    for k in range(count):
        i = _index(looked_at.listed[_index(k)])
        t, ax, ay, az, square, second, third, high = height_over_cloth(
            covered, skin, i, looked_at.here[i], lengths.steps, vertices_out
        )
        if t < 0:
            continue
        looked_at.here[i] = t
        a, b, c = _index(corners[_index(t), 0]), _index(corners[_index(t), 1]), _index(corners[_index(t), 2])
        if square < LEAST_AREA or idle[a] or idle[b] or idle[c]:
            continue
        length = math.sqrt(square)
        lack = high / length + lengths.gap
        if lack <= 0 or lack > lengths.deepest:
            continue
        second, third = second / square, third / square
        first = np.float32(1) - second - third
        step = lack / (first * first + second * second + third * third) / length
        ax, ay, az = step * ax, step * ay, step * az
        out[a, 0], out[a, 1], out[a, 2] = out[a, 0] + first * ax, out[a, 1] + first * ay, out[a, 2] + first * az
        out[b, 0], out[b, 1], out[b, 2] = out[b, 0] + second * ax, out[b, 1] + second * ay, out[b, 2] + second * az
        out[c, 0], out[c, 1], out[c, 2] = out[c, 0] + third * ax, out[c, 1] + third * ay, out[c, 2] + third * az
        moved += 1
    return moved
