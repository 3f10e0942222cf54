"""Compiled winding numbers of a closed mesh about points, by signed crossings of a ray along x.

Here the points are vertices of the same body. As bodies are symmetric, their rays meet corners and edges exactly, so
ties are broken by moving the point. `collide.winding.winding_kernels` tests any points in a grid, and
`collide.projection.ray_kernels` tests them in real time, in float32 and by leaves of the body's surface.
"""

import numpy as np

from hemline.compiled import kernel


@kernel
def _side_of_edge(y0, z0, y1, z1, y, z):
    """Tells on which side of a directed edge a point lies, seen along x.

    Reads: y0, z0, y1, z1: start and end of the edge [m]; y, z: the point [m].
    Returns: A number whose sign is the side [m^2].
    """
    return (y1 - y0) * (z - z0) - (z1 - z0) * (y - y0)


@kernel
def _side(vertices, a, b, y, z):
    """Tells whether a point lies on the left of the edge a to b, seen along x.

    A point on the edge is moved a little along y, then less along z, and an edge is always tested in the same
    direction. So no ray slips between two faces, or hits both, even where it meets a vertex (bodies are symmetric).

    Reads: vertices (verts, 3) [m]; a, b: ends of the edge; y, z: the point [m].
    Returns: Whether it lies on the left.
    """
    swap = b < a
    low, high = (b, a) if swap else (a, b)
    y0, z0, y1, z1 = vertices[low, 1], vertices[low, 2], vertices[high, 1], vertices[high, 2]
    side = _side_of_edge(y0, z0, y1, z1, y, z)
    left = side > 0 or (side == 0 and (z1 < z0 or (z1 == z0 and y1 > y0)))
    return left != swap


@kernel
def _bounds(vertices, faces, bounds_out):
    """Computes the lowest and highest coordinates of a mesh.

    Reads: vertices (verts, 3) [m]; faces (faces, 3).
    Writes: bounds_out (2, 3) [m].
    """
    for c in range(3):
        bounds_out[0, c], bounds_out[1, c] = np.inf, -np.inf
    for f in range(len(faces)):
        for corner in faces[f]:
            for c in range(3):
                bounds_out[0, c] = min(bounds_out[0, c], vertices[corner, c])
                bounds_out[1, c] = max(bounds_out[1, c], vertices[corner, c])


@kernel
def _faces_by_slab(vertices, faces, low, scale, starts_out):
    """Lists faces by slabs of equal height; a face is listed in each slab that it reaches.

    Reads: vertices (verts, 3) [m]; faces (faces, 3); low: lowest height [m]; scale: slabs per height [1/m].
    Writes: starts_out (slabs + 2,): where each slab begins.
    Returns: The faces, slab by slab (listed,).
    """
    count = len(starts_out) - 2
    first, last = np.empty(len(faces), dtype=np.int32), np.empty(len(faces), dtype=np.int32)
    starts_out[:] = 0
    for f in range(len(faces)):
        y0, y1, y2 = vertices[faces[f, 0], 1], vertices[faces[f, 1], 1], vertices[faces[f, 2], 1]
        first[f] = min(int((min(y0, y1, y2) - low) * scale), count - 1)
        last[f] = min(int((max(y0, y1, y2) - low) * scale), count - 1)
        for slab in range(first[f], last[f] + 1):
            starts_out[slab + 2] += 1
    for slab in range(count):
        starts_out[slab + 2] += starts_out[slab + 1]
    listed = np.empty(starts_out[count + 1], dtype=np.int32)
    for f in range(len(faces)):
        for slab in range(first[f], last[f] + 1):
            listed[starts_out[slab + 1]] = f
            starts_out[slab + 1] += 1
    return listed


@kernel
def _crossing(vertices, a, b, c, x, y, z):
    """Crosses the ray from a point along x with a face.

    Reads: vertices (verts, 3) [m]; a, b, c: corners of the face; x, y, z: the point [m].
    Returns: +1 or -1 if the ray crosses outwards or inwards, else 0.
    """
    za, zb, zc = vertices[a, 2], vertices[b, 2], vertices[c, 2]
    if min(za, zb, zc) > z or max(za, zb, zc) < z or max(vertices[a, 0], vertices[b, 0], vertices[c, 0]) < x:
        return 0
    left = _side(vertices, a, b, y, z)
    if left != _side(vertices, b, c, y, z) or left != _side(vertices, c, a, y, z):
        return 0
    share_a = _side_of_edge(vertices[b, 1], zb, vertices[c, 1], zc, y, z)
    share_b = _side_of_edge(vertices[c, 1], zc, vertices[a, 1], za, y, z)
    share_c = _side_of_edge(vertices[a, 1], za, vertices[b, 1], zb, y, z)
    total = share_a + share_b + share_c
    if total == 0:
        return 0
    at = (share_a * vertices[a, 0] + share_b * vertices[b, 0] + share_c * vertices[c, 0]) / total
    return (1 if left else -1) if at > x else 0


@kernel
def mark_inside(vertices, faces, tested, slabs, inside_out):
    """Marks vertices with a positive winding number. Faces are sorted into slabs of equal height to test few each.

    Reads: vertices (verts, 3) float64 [m]; faces (faces, 3); tested (tested,): vertices; slabs: number of slabs.
    Writes: inside_out (verts,) bool: set where the winding number is positive, unchanged elsewhere.
    """
    bounds = np.empty((2, 3))
    _bounds(vertices, faces, bounds)
    scale = slabs / max(bounds[1, 1] - bounds[0, 1], 1e-12)
    starts = np.empty(slabs + 2, dtype=np.int32)
    listed = _faces_by_slab(vertices, faces, bounds[0, 1], scale, starts)
    for v in tested:
        x, y, z = vertices[v, 0], vertices[v, 1], vertices[v, 2]
        if y < bounds[0, 1] or y > bounds[1, 1] or z < bounds[0, 2] or z > bounds[1, 2] or x > bounds[1, 0]:
            continue
        slab = min(int((y - bounds[0, 1]) * scale), slabs - 1)
        winding = 0
        for place in range(starts[slab], starts[slab + 1]):
            f = listed[place]
            winding += _crossing(vertices, faces[f, 0], faces[f, 1], faces[f, 2], x, y, z)
        if winding > 0:
            inside_out[v] = True
