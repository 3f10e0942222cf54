"""Cuts a mesh into compact parts, by repeated halving along the longest path through each."""

import numpy as np

from hemline.compiled import kernel
from hemline.sim.cloth.rows import Rows


@kernel
def _sweep(graph: Rows, owner, number, members, first, seen_out, order_out):
    """Orders vertices by breadth-first search from one of them; disconnected ones come after.

    Reads: graph: neighbours of each vertex; members: the vertices, whose owner (verts,) is `number`; first: the one to
        begin with.
    Writes: seen_out (verts,): counted up for each member, all equal before; order_out (members,).
    """
    starts, columns = graph
    stamp = seen_out[first] + 1
    found = head = after = 0
    start = first
    while found < members.shape[0]:
        order_out[found] = start
        seen_out[start] = stamp
        found += 1
        while head < found:
            v = order_out[head]
            head += 1
            for entry in range(starts[v], starts[v + 1]):
                j = columns[entry]
                if owner[j] == number and seen_out[j] != stamp:
                    order_out[found] = j
                    seen_out[j] = stamp
                    found += 1
        while after < members.shape[0] and seen_out[members[after]] == stamp:
            after += 1
        if after < members.shape[0]:
            start = members[after]


@kernel
def bisect_vertices(graph: Rows, members, parts, part_out):
    """Cuts vertices into parts.

    Reads: graph: neighbours of each vertex; members: vertices to be cut, ascending; parts: number of parts.
    Writes: part_out (verts,): part of each member; other entries stay.
    Returns: The number of parts, which is smaller than requested if there are fewer vertices.
    """
    count, made, number = graph.starts.shape[0] - 1, 0, 0
    owner, seen = np.full(count, -1, np.int64), np.zeros(count, np.int64)
    order, room, first_half = (
        np.empty(members.shape[0], np.int64),
        np.empty(members.shape[0], np.int64),
        np.zeros(count, np.bool_),
    )
    left = members.copy()
    # what is still to be cut: from, to, parts; each cut adds one
    waiting, top = np.empty((parts + 2, 3), np.int64), 1
    waiting[0, 0], waiting[0, 1], waiting[0, 2] = 0, members.shape[0], parts
    while top:
        top -= 1
        low, high, many = waiting[top, 0], waiting[top, 1], waiting[top, 2]
        if many <= 1 or high - low < 2:
            for k in range(low, high):
                part_out[left[k]] = made
            made += 1
            continue
        here, found = left[low:high], order[: high - low]
        for k in range(high - low):
            owner[here[k]] = number
        _sweep(graph, owner, number, here, here[0], seen, found)
        _sweep(graph, owner, number, here, found[high - low - 1], seen, found)
        number += 1
        half = (high - low) * (many // 2) // many
        for k in range(high - low):
            first_half[found[k]] = k < half
        one, two = 0, half
        for k in range(high - low):
            if first_half[here[k]]:
                room[one] = here[k]
                one += 1
            else:
                room[two] = here[k]
                two += 1
        for k in range(high - low):
            here[k] = room[k]
        waiting[top, 0], waiting[top, 1], waiting[top, 2] = low + half, high, many - many // 2
        waiting[top + 1, 0], waiting[top + 1, 1], waiting[top + 1, 2] = low, low + half, many // 2
        top += 2
    return made


__all__ = ["bisect_vertices"]
