"""Compiled: close-fitting cloth within its limits: no edge too long, no vertex in the skin, no skin in front of it."""

from typing import NamedTuple

import numpy as np

from hemline.arrays import Int
from hemline.collide.cover.cover_kernels import (
    CoveredPoints,
    CoveredSkin,
    CoverLengths,
    cover_points,
    list_covered,
)
from hemline.collide.whole.limit_kernels import limit_coarse
from hemline.collide.whole.models import CoarseModel, FineModel
from hemline.compiled import kernel

from .skin_plane_kernels import find_planes, follow_planes

_index = np.uintp
TOLERANCE = np.float32(1.0005)
"""Length of an edge over its limit up to which it is left alone."""
UNSETTLED = np.float32(2e-4)
"""A vertex that a half-space moves by more than this keeps the sweeps going [m]."""
TOO_LONG = np.float32(1.02)
"""Length of an edge over its limit from which it counts when the sweeps have ended."""

TORN = np.float32(1.7)
"""Length of an edge over its limit from which half-spaces are taken to tear the cloth apart."""
HELD_BACK = np.float32(0.003)
"""A vertex that a half-space keeps farther than this from where the animator has it may be given up [m]."""
GIVING_UP = 5
"""Rounds in which vertices are given up, at most."""


class CloseModel(NamedTuple):
    """A garment that lies close to the body, as the kernel takes it; vertices are in the kernels' order."""

    homes: Int[np.ndarray, " verts"]
    """Vertex of the skin next to each vertex at rest."""
    fine: FineModel
    """All edges."""
    coarse: CoarseModel
    """About a hundred control vertices; all vertices are samples."""
    medium: CoarseModel
    """Several hundred control vertices; all vertices are samples."""
    covered: CoveredSkin
    """Vertices of the skin that the garment covers at rest."""


class CloseLimits(NamedTuple):
    """Settings of `hold_close`."""

    stretch: np.float32
    """Longest length of an edge over the longer of its length on the pattern and at rest on the body."""
    rest_stretch: np.float32
    """Largest length at rest on the body that counts, over that on the pattern."""
    sink: np.float32
    """Depth below its half-space to which a vertex may sink while control vertices are moved [m]."""
    cover: CoverLengths
    """Distances between cloth and the skin that it covers."""
    cover_margin: np.float32
    """Skin farther behind the cloth than this at the start of a round is not looked at in the round [m]."""
    coarse_sweeps: int
    """Sweeps over the edges between control vertices."""
    fewest: np.float32
    """Fraction of violated constraints after the first round up to which control vertices are not moved."""
    many: np.float32
    """Fraction from which they are moved in full."""
    fine_sweeps: int
    """Sweeps over all edges in each round."""


@kernel
def longest_lengths(edges, lengths, controls, rest, limits):
    """Computes the longest length that each edge may have.

    Reads: edges (edges, 2): numbers in `controls`; lengths (edges,): on the pattern [m]; controls: vertex of each
        number; rest (verts, 3): the garment at rest on this body [m]; limits: `CloseLimits`.
    Returns: The lengths (edges,), float32 [m].
    """
    longest = np.empty(len(edges), np.float32)
    for e in range(len(edges)):
        a, b = _index(controls[_index(edges[e, 0])]), _index(controls[_index(edges[e, 1])])
        x, y, z = rest[b, 0] - rest[a, 0], rest[b, 1] - rest[a, 1], rest[b, 2] - rest[a, 2]
        at_rest = min(np.sqrt(x * x + y * y + z * z), limits.rest_stretch * lengths[e])
        longest[e] = limits.stretch * max(lengths[e], at_rest)
    return longest


@kernel
def list_edges(edges, longest, moved, listed):
    """Lists the edges that are too long.

    Reads: edges (edges, 2); longest (edges,): longest lengths [m]; moved (verts, 3) [m].
    Writes: listed (edges + 1,): these edges come first.
    Returns: The number of listed edges.
    """
    count = np.int64(0)
    for place in range(len(edges)):
        e = _index(place)
        a, b, most = _index(edges[e, 0]), _index(edges[e, 1]), TOLERANCE * longest[e]
        x, y, z = moved[b, 0] - moved[a, 0], moved[b, 1] - moved[a, 1], moved[b, 2] - moved[a, 2]
        listed[_index(count)] = place
        count += np.int64(x * x + y * y + z * z > most * most)
    return count


@kernel
def shorten_edges(model, longest, listed, count, backwards, moved):
    """Shortens listed edges, as far as they are still too long.

    Reads: model: a `FineModel`; longest (edges,): longest lengths [m]; listed[:count]: edges; backwards: their order.
    Writes: moved (verts, 3) [m].
    """
    edges, free = model.edges, model.free
    for k in range(count):
        e = _index(listed[_index(count - 1 - k if backwards else k)])
        a, b = _index(edges[e, 0]), _index(edges[e, 1])
        x, y, z = moved[b, 0] - moved[a, 0], moved[b, 1] - moved[a, 1], moved[b, 2] - moved[a, 2]
        length = np.sqrt(x * x + y * y + z * z)
        if length <= longest[e]:
            continue
        pull = (length - longest[e]) / (length * max(free[a] + free[b], np.float32(1)))
        for_a, for_b = pull * free[a], pull * free[b]
        moved[a, 0] += for_a * x
        moved[a, 1] += for_a * y
        moved[a, 2] += for_a * z
        moved[b, 0] -= for_b * x
        moved[b, 1] -= for_b * y
        moved[b, 2] -= for_b * z


@kernel(fastmath={"contract"})
def count_long(edges, longest, moved):
    """Counts the edges that are clearly too long.

    Reads: edges (edges, 2); longest (edges,): longest lengths [m]; moved (verts, 3) [m].
    Returns: The number of edges.
    """
    count = 0
    for e in range(len(edges)):
        a, b, most = _index(edges[e, 0]), _index(edges[e, 1]), TOO_LONG * longest[e]
        x, y, z = moved[b, 0] - moved[a, 0], moved[b, 1] - moved[a, 1], moved[b, 2] - moved[a, 2]
        count += x * x + y * y + z * z > most * most
    return count


@kernel
def push_out(found, count, free, moved):
    """Moves vertices into their half-spaces.

    Reads: found: planes and list of `SkinPlanes`; count: number of vertices that have a half-space; free (verts,): 1,
        or 0 for pinned vertices.
    Writes: moved (verts, 3) [m].
    Returns: The number of vertices that were moved far.
    """
    far, planes = 0, found.planes
    for k in range(count):
        i = _index(found.listed[k])
        nx, ny, nz = planes[i, 0], planes[i, 1], planes[i, 2]
        lack = (planes[i, 3] - (nx * moved[i, 0] + ny * moved[i, 1] + nz * moved[i, 2])) * free[i]
        if lack > 0:
            moved[i, 0] += lack * nx
            moved[i, 1] += lack * ny
            moved[i, 2] += lack * nz
            far += lack > UNSETTLED
    return far


@kernel
def sweep_constraints(skin, close, longest, found, count, limits, moved):
    """Sweeps over edges, covered skin and half-spaces, in this order, until little moves.

    Half-spaces come last, so that no vertex is left in the skin. Covered skin takes part in every second sweep; skin
    that is far behind the cloth in the first of these is left out.

    Reads: skin; close: a `CloseModel`; longest (edges,): longest lengths [m]; found, count: the half-spaces; limits.
    Writes: moved (verts, 3) [m].
    Returns: The number of constraints that are clearly violated in the end: edges, and covered skin and half-spaces
        that moved a vertex in the last sweep.
    """
    model, covered, unsettled = close.fine, close.covered, 0
    listed, points = np.empty(len(model.edges) + 1, np.int32), len(covered.points)
    looked_at = CoveredPoints(np.empty(points, np.int32), np.empty(points + 1, np.int32))
    for sweep in range(limits.fine_sweeps):
        unsettled, violated = 0, list_edges(model.edges, longest, moved, listed)
        shorten_edges(model, longest, listed, violated, sweep % 2 == 1, moved)
        if sweep == 1:
            points = list_covered(covered, skin.body, limits.cover, limits.cover_margin, moved, looked_at)
        if sweep % 2 == 1:
            unsettled += cover_points(covered, skin.body, found.pinched, limits.cover, looked_at, points, moved)
        unsettled += push_out(found, count, model.free, moved)
        if violated + unsettled == 0 and sweep > 0:
            break
    return unsettled + count_long(model.edges, longest, moved)


@kernel
def give_up_torn(edges, longest, points, found, count, moved):
    """Gives up vertices whose half-spaces tear the cloth: it goes through the middle of a limb.

    Half-spaces on opposite sides of a limb would lead neighbours out in opposite directions. Those at the ends of a
    torn edge follow their neighbours instead, from where the animator has them.

    Reads: edges (edges, 2); longest (edges,): longest lengths [m]; points (verts, 3): the garment of the animator [m].
    Writes: found: the list of half-spaces, and who is pinched; moved (verts, 3) [m].
    Returns: The number of vertices that still have a half-space.
    """
    planes, pinched, kept = found.planes, found.pinched, np.zeros(len(points), np.bool_)
    for k in range(count):
        kept[_index(found.listed[k])] = True
    for e in range(len(edges)):
        a, b, most = _index(edges[e, 0]), _index(edges[e, 1]), TORN * longest[e]
        x, y, z = moved[b, 0] - moved[a, 0], moved[b, 1] - moved[a, 1], moved[b, 2] - moved[a, 2]
        if x * x + y * y + z * z <= most * most:
            continue
        for i in (a, b):
            height = planes[i, 0] * points[i, 0] + planes[i, 1] * points[i, 1] + planes[i, 2] * points[i, 2]
            if kept[i] and height - planes[i, 3] < -HELD_BACK:
                pinched[i] = True
    left = 0
    for k in range(count):
        i = _index(found.listed[k])
        if pinched[i]:
            moved[i, 0], moved[i, 1], moved[i, 2] = points[i, 0], points[i, 1], points[i, 2]
        else:
            found.listed[left] = found.listed[k]
            left += 1
    return left


@kernel
def move_controls(model, longest, found, count, limits, weight, moved):
    """Brings the edges between control vertices within their limits, and moves all vertices with these.

    Reads: model: a `CoarseModel` of which all vertices are samples; longest (edges,) [m]; found, count: the
        half-spaces; limits; weight: fraction of the move that is carried out, 0 to 1.
    Writes: moved (verts, 3) [m].
    """
    controls = len(model.controls)
    if controls == 0:
        return
    bounded = CoarseModel(
        model.controls,
        model.edges,
        longest,
        model.free,
        model.weight_ids,
        model.weights,
        model.samples,
        model.triangles,
    )
    sunk, shifts = found.planes.copy(), np.zeros((controls, 3), np.float32)
    sunk[:, 3] -= limits.sink
    limit_coarse(moved, bounded, sunk, found.listed[:count], limits.coarse_sweeps, shifts)
    for i in range(len(moved)):
        for k in range(model.weights.shape[1]):
            c, part = _index(model.weight_ids[i, k]), weight * model.weights[i, k]
            for axis in range(3):
                moved[i, axis] += part * shifts[c, axis]


@kernel
def hold_close(skin, close, rest, points, distances, limits, found, moved):
    """Brings close-fitting cloth within its limits, starting from the positions of the animator alone.

    Three rounds of sweeps over all edges. Between them coarse and medium control vertices are moved first, then medium
    ones; a calm frame ends after the first round. Control vertices are moved the more, the more is violated, so that
    frames on both sides of the limit look alike.

    Reads: skin; close: a `CloseModel`; rest (verts, 3): the garment at rest on this body [m]; points (verts, 3): the
        garment of the animator [m]; distances: `SkinDistances`; limits: `CloseLimits`.
    Writes: found: `SkinPlanes`; moved (verts, 3) [m].
    """
    moved[:] = points
    count = find_planes(skin, close.homes, points, distances, found)
    every, coarse, medium = np.arange(len(points)), close.coarse, close.medium
    longest = longest_lengths(close.fine.edges, close.fine.lengths, every, rest, limits)
    longest_coarse = longest_lengths(coarse.edges, coarse.lengths, coarse.controls, rest, limits)
    longest_medium = longest_lengths(medium.edges, medium.lengths, medium.controls, rest, limits)
    for turn in range(3):
        violated = sweep_constraints(skin, close, longest, found, count, limits, moved)
        share = (np.float32(violated) / max(len(longest), 1) - limits.fewest) / (limits.many - limits.fewest)
        if share <= 0 or turn == 2:
            break
        weight = min(share, np.float32(1))
        if turn == 0:
            move_controls(coarse, longest_coarse, found, count, limits, weight, moved)
        if turn < 2:
            move_controls(medium, longest_medium, found, count, limits, weight, moved)
            for i in range(len(points)):
                if close.fine.free[i] == 0:
                    moved[i, 0], moved[i, 1], moved[i, 2] = points[i, 0], points[i, 1], points[i, 2]
        follow_planes(skin, moved, distances.gap, found, count)
    for _round in range(GIVING_UP):
        left = give_up_torn(close.fine.edges, longest, points, found, count, moved)
        if left == count:
            break
        count = left
        sweep_constraints(skin, close, longest, found, count, limits, moved)
    for k in range(count):
        i = _index(found.listed[k])
        x, y, z = moved[i, 0], moved[i, 1], moved[i, 2]
        plane = found.planes[i, 0] * x + found.planes[i, 1] * y + found.planes[i, 2] * z - found.planes[i, 3]
        found.heights[i] = plane + distances.gap
