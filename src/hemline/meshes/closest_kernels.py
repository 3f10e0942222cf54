"""Compiled: the nearest point of a triangle mesh, exact, by a tree of boxes."""

from typing import NamedTuple

import numpy as np

from hemline.arrays import Float, Int
from hemline.compiled import kernel


class BoxTree(NamedTuple):
    """Triangles in a complete binary tree of boxes: node n has children 2n + 1 and 2n + 2, the last level is leaves."""

    corners: Float[np.ndarray, "faces 3 3"]
    """Corner positions of each triangle [m]."""
    order: Int[np.ndarray, " faces"]
    """Triangles, leaf by leaf."""
    leaf: int
    """Triangles in a leaf."""
    low: Float[np.ndarray, "nodes 3"]
    """Lowest coordinates of each box; there are 2^k - 1 nodes, with 2^(k-1) leaves [m]."""
    high: Float[np.ndarray, "nodes 3"]
    """Highest coordinates of each box [m]."""


@kernel(inline="always")
def _box_distance(point, low, high):
    """Computes the distance of a point from a box.

    Reads: point, low, high (3,) [m].
    Returns: The squared distance [m^2].
    """
    total = 0.0
    for axis in range(3):
        beyond = max(low[axis] - point[axis], point[axis] - high[axis], 0.0)
        total += beyond * beyond
    return total


@kernel
def corner_weights(point, a, b, c):
    """Finds the point of triangle a b c nearest to `point` (Ericson 2005, section 5.1.5).

    Two other kernels find the same regions, with other last bits: `collide.surface.surface_kernels.nearest_weights`
    in float32 about the origin, which the projection calls for each vertex in real time, and
    `sim.contact.body.touch_kernels.closest_on_triangle` in float64 without leaving early, inlined in loops over pairs.
    This one goes region by region and gives exact zeros at corners and edges, which `ClosestTree.outward` relies on.

    Reads: point, a, b, c (3,) [m].
    Returns: the barycentric weights of a, b and c.
    """
    ab, ac, ap = b - a, c - a, point - a
    d1 = ab[0] * ap[0] + ab[1] * ap[1] + ab[2] * ap[2]
    d2 = ac[0] * ap[0] + ac[1] * ap[1] + ac[2] * ap[2]
    if d1 <= 0 and d2 <= 0:
        return 1.0, 0.0, 0.0
    bp = point - b
    d3 = ab[0] * bp[0] + ab[1] * bp[1] + ab[2] * bp[2]
    d4 = ac[0] * bp[0] + ac[1] * bp[1] + ac[2] * bp[2]
    if d3 >= 0 and d4 <= d3:
        return 0.0, 1.0, 0.0
    vc = d1 * d4 - d3 * d2
    if vc <= 0 and d1 >= 0 and d3 <= 0:
        fraction = d1 / (d1 - d3)
        return 1.0 - fraction, fraction, 0.0
    cp = point - c
    d5 = ab[0] * cp[0] + ab[1] * cp[1] + ab[2] * cp[2]
    d6 = ac[0] * cp[0] + ac[1] * cp[1] + ac[2] * cp[2]
    if d6 >= 0 and d5 <= d6:
        return 0.0, 0.0, 1.0
    vb = d5 * d2 - d1 * d6
    if vb <= 0 and d2 >= 0 and d6 <= 0:
        fraction = d2 / (d2 - d6)
        return 1.0 - fraction, 0.0, fraction
    va = d3 * d6 - d5 * d4
    if va <= 0 and d4 - d3 >= 0 and d5 - d6 >= 0:
        fraction = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        return 0.0, 1.0 - fraction, fraction
    scale = 1.0 / (va + vb + vc)
    return 1.0 - (vb + vc) * scale, vb * scale, vc * scale


@kernel
def fill_boxes(tree: BoxTree):
    """Computes the boxes of a tree.

    Reads: tree: corners, order and leaf.
    Writes: tree: low and high.
    """
    corners, order, leaf, low_out, high_out = tree
    nodes = len(low_out)
    leaves = (nodes + 1) // 2
    low_out[:] = np.inf
    high_out[:] = -np.inf
    for place in range(len(order)):
        node = leaves - 1 + place // leaf
        for corner in range(3):
            for axis in range(3):
                value = corners[order[place], corner, axis]
                low_out[node, axis] = min(low_out[node, axis], value)
                high_out[node, axis] = max(high_out[node, axis], value)
    for node in range(leaves - 2, -1, -1):
        for axis in range(3):
            low_out[node, axis] = min(low_out[2 * node + 1, axis], low_out[2 * node + 2, axis])
            high_out[node, axis] = max(high_out[2 * node + 1, axis], high_out[2 * node + 2, axis])


@kernel
def nearest_points(points, tree: BoxTree, face_out, weights_out, squared_out):
    """Finds the nearest triangle, the barycentric weights there and the squared distance, for each point.

    The search is exact, over all triangles, and meant for offline work. `collide.surface.surface_kernels.walk` and
    `sim.contact.body.touch_kernels.closest_faces` follow a moving body from the last place or the nearest vertex on,
    without a tree, which would have to be built in each frame.

    Reads: points (points, 3) [m]; tree.
    Writes: face_out (points,), weights_out (points, 3), squared_out (points,) [m^2].
    """
    corners, order, leaf, low, high = tree
    leaves = (len(low) + 1) // 2
    stack = np.empty(64, np.int64)
    for index in range(len(points)):
        point = points[index]
        best = np.inf
        # the last point's answer is a good first bound: neighbours in a mesh are neighbours in space
        face = np.int64(face_out[index - 1]) if index > 0 else np.int64(order[0])
        a, b, c = corner_weights(point, corners[face, 0], corners[face, 1], corners[face, 2])
        for axis in range(3):
            weights_out[index, axis] = (a, b, c)[axis]
        best = _distance_squared(point, corners[face], a, b, c)
        top = 1
        stack[0] = 0
        while top > 0:
            top -= 1
            node = stack[top]
            if _box_distance(point, low[node], high[node]) >= best:
                continue
            if node < leaves - 1:
                left = _box_distance(point, low[2 * node + 1], high[2 * node + 1])
                right = _box_distance(point, low[2 * node + 2], high[2 * node + 2])
                near_first = left <= right
                stack[top] = 2 * node + 2 if near_first else 2 * node + 1
                stack[top + 1] = 2 * node + 1 if near_first else 2 * node + 2
                top += 2
                continue
            start = (node - leaves + 1) * leaf
            for place in range(start, min(start + leaf, len(order))):
                candidate = order[place]
                a, b, c = corner_weights(point, corners[candidate, 0], corners[candidate, 1], corners[candidate, 2])
                squared = _distance_squared(point, corners[candidate], a, b, c)
                if squared < best:
                    best = squared
                    face = candidate
                    weights_out[index, 0], weights_out[index, 1], weights_out[index, 2] = a, b, c
        face_out[index] = face
        squared_out[index] = best


@kernel
def _distance_squared(point, corner, a, b, c):
    """Computes the distance of a point from a point of a triangle.

    Reads: point (3,) [m]; corner (3, 3): corners of the triangle [m]; a, b, c: their weights.
    Returns: The squared distance [m^2].
    """
    total = 0.0
    for axis in range(3):
        offset = point[axis] - (a * corner[0, axis] + b * corner[1, axis] + c * corner[2, axis])
        total += offset * offset
    return total


@kernel
def order_by_halves(centres, leaf, leaves):
    """Orders points so that each half, quarter, eighth and so on is compact, by splits along the widest axis.

    Reads: centres (points, 3) [m]; leaf: points in a leaf; leaves: number of leaves, a power of two.
    Returns: The numbers of the points, leaf by leaf (points,), int32.
    """
    order, stack = np.arange(len(centres)).astype(np.int32), np.empty((64, 3), np.int64)
    stack[0, 0], stack[0, 1], stack[0, 2], depth = 0, len(centres), leaves, 1
    while depth:
        depth -= 1
        start, end, under = stack[depth, 0], stack[depth, 1], stack[depth, 2]
        if under == 1 or end - start <= leaf:
            continue
        axis, widest = 0, -1.0
        for each in range(3):
            low, high = np.inf, -np.inf
            for k in range(start, end):
                low, high = min(low, centres[order[k], each]), max(high, centres[order[k], each])
            if high - low > widest:
                axis, widest = each, high - low
        middle = min(start + leaf * (under // 2), end)
        if middle < end:
            split_at(centres, axis, order, start, end, middle)
        for first, last in ((start, middle), (middle, end)):
            stack[depth, 0], stack[depth, 1], stack[depth, 2] = first, last, under // 2
            depth += 1
    return order


@kernel
def split_at(centres, axis, order, start, end, middle):
    """Reorders order[start:end] so that no point before `middle` is farther along an axis than one after it (Hoare).

    Reads: centres (points, 3) [m]; axis; start, end, middle.
    Writes: order (points,).
    """
    low, high = start, end - 1
    while low < high:
        pivot = centres[order[(low + high) // 2], axis]
        i, j = low, high
        while i <= j:
            while centres[order[i], axis] < pivot:
                i += 1
            while centres[order[j], axis] > pivot:
                j -= 1
            if i <= j:
                order[i], order[j] = order[j], order[i]
                i += 1
                j -= 1
        if middle <= j:
            high = j
        elif middle >= i:
            low = i
        else:
            break
