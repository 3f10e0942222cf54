"""Compiled: vertices of a triangle mesh are collapsed onto a neighbour one by one, the cheapest first."""

import heapq
import math

import numpy as np

from hemline.compiled import kernel

from .fan_kernels import MAX_FACES, corner_of, flatten_fan

THINNEST = 0.15
"""Least area of a new triangle, as a fraction of the equilateral one on its longest edge."""
THINNEST_ALONG = 0.08
"""Least area of a new triangle with its lengths along the cloth, as the same fraction. These lengths differ from those
in the flat fan where the fan was scaled to a full turn, or where an edge is there already."""
_EQUILATERAL = math.sqrt(3.0) / 2


@kernel
def _common_neighbours(mesh, fan, size, target):
    """Counts the vertices of a ring that are neighbours of a target.

    Reads: mesh; fan; size: vertices of the ring; target: a vertex.
    Returns: The number of vertices.
    """
    found = 0
    for i in range(size):
        vertex, near = fan.ring[i], False
        if vertex == target:
            continue
        for k in range(mesh.counts[target]):
            face = mesh.around[target, k]
            for corner in range(3):
                near = near or mesh.faces[face, corner] == vertex
        found += near
    return found


@kernel
def _lengths_there(mesh, vertex, fan, count, target):
    """Finds the edges that lead from a target to neighbours in the ring already.

    Reads: mesh; vertex; fan: that of the vertex; count: faces of the fan; target: place in the ring.
    Returns: The neighbour before the target and the one after it, -1 where there is none, and the lengths of the edges
        along the cloth [m].
    """
    goal, before, after, length_before, length_after = fan.ring[target], -1, -1, 0.0, 0.0
    for i in range(count):
        if fan.ring[i] != goal and fan.ring[i + 1] != goal:
            continue
        face = fan.faces[i]
        length = mesh.lengths[face, (corner_of(mesh.faces, face, vertex) + 1) % 3]
        if fan.ring[i] == goal:
            after, length_after = fan.ring[i + 1], length
        else:
            before, length_before = fan.ring[i], length
    return before, after, length_before, length_after


@kernel
def _length_to(fan, place, target, there):
    """Computes the length along the cloth that the edge from a target to a place of the ring gets.

    Reads: fan; place, target: places in the ring; there: what `_lengths_there` returns.
    Returns: The length [m].
    """
    if fan.ring[place] == there[0]:
        return there[2]
    if fan.ring[place] == there[1]:
        return there[3]
    return math.hypot(fan.flat[place, 0] - fan.flat[target, 0], fan.flat[place, 1] - fan.flat[target, 1])


@kernel
def _stays(mesh, vertex, fan, count, target):
    """Tells whether no triangle flips or becomes thin when a vertex collapses onto a target.

    Reads: mesh; vertex; fan: that of the vertex; count: faces of the fan; target: place in the ring.
    Returns: Whether all triangles stay sound.
    """
    goal, there = fan.ring[target], _lengths_there(mesh, vertex, fan, count, target)
    for i in range(count):
        if fan.ring[i] == goal or fan.ring[i + 1] == goal:
            continue
        ax, ay = fan.flat[i, 0] - fan.flat[target, 0], fan.flat[i, 1] - fan.flat[target, 1]
        bx, by = fan.flat[i + 1, 0] - fan.flat[target, 0], fan.flat[i + 1, 1] - fan.flat[target, 1]
        longest = max(ax * ax + ay * ay, bx * bx + by * by, (ax - bx) ** 2 + (ay - by) ** 2)
        if ax * by - ay * bx < THINNEST * _EQUILATERAL * longest:
            return False
        face = fan.faces[i]
        a, b = _length_to(fan, i, target, there), _length_to(fan, i + 1, target, there)
        c = mesh.lengths[face, (corner_of(mesh.faces, face, vertex) + 1) % 3]
        # Heron's formula for the square of four times the area
        square = (a + b + c) * (b + c - a) * (a + c - b) * (a + b - c)
        least = 2 * THINNEST_ALONG * _EQUILATERAL * max(a, b, c) ** 2
        if square < least * least:
            return False
    return True


@kernel
def _may_collapse(mesh, vertex, fan, count, target):
    """Tells whether a collapse keeps the mesh manifold, and rims and bound vertices in place.

    Reads: mesh; vertex; fan: that of the vertex; count: faces of the fan; target: place in the ring.
    Returns: Whether it does.
    """
    goal, closed = fan.ring[target], fan.closed[0]
    if mesh.bound[vertex] & ~mesh.bound[goal] or mesh.counts[goal] + count - 2 > MAX_FACES:
        return False
    if not closed and 0 < target < count:
        return False
    size = count if closed else count + 1
    if _common_neighbours(mesh, fan, size, goal) != (2 if closed else 1):
        return False
    for step in (-1, 1):
        beside = target + step
        if closed:
            beside %= count
        if 0 <= beside < size:
            other = fan.ring[beside]
            if mesh.counts[other] <= (1 if mesh.rim[other] else 3):
                return False
    return True


@kernel
def best_collapse(mesh, vertex, evenness, fan):
    """Finds the neighbour onto which a vertex collapses at the least cost.

    The cost is the squared distance to the planes of all vertices that it has absorbed, weighted by area, plus
    `evenness` times the fourth power of the longest new edge.

    Source: Garland, Heckbert, "Surface simplification using quadric error metrics", 1997. Differs: vertices collapse
        onto neighbours only; evenness.

    Reads: mesh; vertex; evenness.
    Writes: fan.
    Returns: the cost [m^4], infinite if no collapse is allowed, and the neighbour's place in the ring.
    """
    count = flatten_fan(mesh, vertex, fan)
    best, place = np.inf, 0
    quadric = mesh.quadrics[vertex]
    for target in range(count if count == 0 or fan.closed[0] else count + 1):
        if not _may_collapse(mesh, vertex, fan, count, target):
            continue
        x, y, z = mesh.positions[fan.ring[target]]
        bent = quadric[0] * x * x + quadric[3] * y * y + quadric[5] * z * z + quadric[9]
        bent += 2 * (quadric[1] * x * y + quadric[2] * x * z + quadric[4] * y * z)
        bent += 2 * (quadric[6] * x + quadric[7] * y + quadric[8] * z)
        longest = 0.0
        for i in range(count + 1):
            dx, dy = fan.flat[i, 0] - fan.flat[target, 0], fan.flat[i, 1] - fan.flat[target, 1]
            longest = max(longest, dx * dx + dy * dy)
        cost = max(bent, 0.0) + evenness * longest * longest
        if cost < best and _stays(mesh, vertex, fan, count, target):
            best, place = cost, target
    return best, place


@kernel
def _drop(mesh, vertex, face):
    """Takes a face out of those around a vertex.

    Reads: vertex; face.
    Writes: mesh.
    """
    for k in range(mesh.counts[vertex]):
        if mesh.around[vertex, k] == face:
            mesh.counts[vertex] -= 1
            mesh.around[vertex, k] = mesh.around[vertex, mesh.counts[vertex]]
            return


@kernel
def _collapse(mesh, vertex, fan, count, target):
    """Collapses a vertex onto a target: two faces vanish, or one at a rim; new edges get their flat lengths.

    Reads: vertex; fan: that of the vertex; count: faces of the fan; target: place in the ring.
    Writes: mesh.
    """
    goal, there = fan.ring[target], _lengths_there(mesh, vertex, fan, count, target)
    for i in range(count):
        face = fan.faces[i]
        if fan.ring[i] == goal or fan.ring[i + 1] == goal:
            _drop(mesh, fan.ring[i], face)
            _drop(mesh, fan.ring[i + 1], face)
            mesh.faces[face, 0] = -1
    for i in range(count):
        face = fan.faces[i]
        if mesh.faces[face, 0] < 0:
            continue
        corner = corner_of(mesh.faces, face, vertex)
        mesh.lengths[face, corner] = _length_to(fan, i, target, there)
        mesh.lengths[face, (corner + 2) % 3] = _length_to(fan, i + 1, target, there)
        mesh.faces[face, corner] = goal
        mesh.around[goal, mesh.counts[goal]] = face
        mesh.counts[goal] += 1
    mesh.counts[vertex] = 0
    mesh.quadrics[goal] += mesh.quadrics[vertex]


@kernel
def collapse(mesh, evenness, remaining, fan, kept):
    """Collapses vertices until `remaining` are left, or no collapse is allowed.

    The cost of a vertex is computed again when its fan has changed, and once more when its turn comes.

    Reads: evenness; remaining.
    Writes: mesh; fan, as work space; kept (verts,): whether each vertex is left.
    Returns: how many vertices are left.
    """
    stamps, heap = np.zeros(len(kept), np.int64), [(0.0, np.int64(0), np.int64(-1))]
    for vertex in range(len(kept)):
        cost, _ = best_collapse(mesh, vertex, evenness, fan)
        if cost < np.inf:
            heapq.heappush(heap, (cost, np.int64(vertex), np.int64(0)))
    left, ring = kept.sum(), np.empty(MAX_FACES + 1, np.int64)
    while left > remaining and len(heap) > 0:
        before, vertex, stamp = heapq.heappop(heap)
        if stamp != stamps[vertex]:
            continue
        cost, target = best_collapse(mesh, vertex, evenness, fan)
        if cost > before:
            if cost < np.inf:
                heapq.heappush(heap, (cost, vertex, stamp))
            continue
        count = mesh.counts[vertex]
        size = count if fan.closed[0] else count + 1
        ring[:size] = fan.ring[:size]
        _collapse(mesh, vertex, fan, count, target)
        kept[vertex] = False
        stamps[vertex] += 1
        left -= 1
        for i in range(size):
            stamps[ring[i]] += 1
            cost, _ = best_collapse(mesh, ring[i], evenness, fan)
            if cost < np.inf:
                heapq.heappush(heap, (cost, np.int64(ring[i]), np.int64(stamps[ring[i]])))
    return left
