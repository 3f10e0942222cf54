"""Compiled: the vertex of the body's surface nearest to a point is searched for, by boxes of patches, then of leaves.

A place of the surface that is known already bounds the search: the nearer it is, the fewer leaves are visited.
"""

import numpy as np

from hemline.compiled import kernel

from .box_kernels import LEAF
from .search_lane_kernels import LANES, ROWS, SQUARED, VERTEX, nearest_of_leaves
from .surface_kernels import MOST_STEPS, walk

_index = np.uintp


@kernel
def search_buffers(skin):
    """Makes buffers for searches.

    Reads: skin.
    Returns: A byte a patch, the same bytes by eights, and room for a list of leaves.
    """
    mask = np.zeros((len(skin.patch_limb) + 7) // 8 * 8, np.uint8)
    return mask, mask.view(np.uint64), np.empty(len(skin.leaf_limb), np.int64)


@kernel
def list_leaves(skin, limb, low, high, reach, buffers):
    """Lists leaves of a limb, or (limb < 0) of the whole body, that may be nearer to a box than a distance.

    Reads: skin; limb; low, high: corners of the box [m]; reach: square of the distance [m^2].
    Writes: buffers, of `search_buffers`: its list of leaves.
    Returns: how many leaves are listed.
    """
    boxes, patch_limb, patch_start, leaf_box = skin.patch_box, skin.patch_limb, skin.patch_start, skin.leaf_box
    mask, words, leaves = buffers
    zero, patches, count = np.float32(0), len(patch_limb), 0
    lx, ly, lz, hx, hy, hz = low[0], low[1], low[2], high[0], high[1], high[2]
    for k in range(patches):  # bytes instead of a list, so that it vectorises
        dx = max(max(boxes[0, k] - hx, lx - boxes[3, k]), zero)
        dy = max(max(boxes[1, k] - hy, ly - boxes[4, k]), zero)
        dz = max(max(boxes[2, k] - hz, lz - boxes[5, k]), zero)
        mask[k] = (dx * dx + dy * dy + dz * dz < reach) & ((limb < 0) | (patch_limb[k] == limb))
    for word in range(len(words)):
        if words[word] == 0:
            continue
        for k in range(word * 8, min(word * 8 + 8, patches)):
            if not mask[k]:
                continue
            for leaf in range(patch_start[k], patch_start[k + 1]):
                b = _index(leaf)
                dx = max(max(leaf_box[0, b] - hx, lx - leaf_box[3, b]), zero)
                dy = max(max(leaf_box[1, b] - hy, ly - leaf_box[4, b]), zero)
                dz = max(max(leaf_box[2, b] - hz, lz - leaf_box[5, b]), zero)
                leaves[count] = leaf
                count += dx * dx + dy * dy + dz * dz < reach
    return count


@kernel(forceinline=True)
def nearest_corner(skin, face, x, y, z):
    """Finds the corner of a face that is nearest to a point.

    Reads: skin; face; x, y, z: the point [m].
    Returns: The vertex at that corner, and its squared distance [m^2].
    """
    body, faces, f = skin.body, skin.faces, _index(face)
    best, nearest = np.int64(0), np.float32(np.inf)
    for corner in (_index(0), _index(1), _index(2)):
        v = _index(faces[f, corner])
        dx, dy, dz = body[v, 0] - x, body[v, 1] - y, body[v, 2] - z
        distance = dx * dx + dy * dy + dz * dz
        if distance < nearest:
            best, nearest = np.int64(v), distance
    return best, nearest


@kernel
def nearest_vertex(skin, leaves, count, x, y, z, best, nearest):
    """Finds the vertex of leaves[:count] nearest to a point, if it is nearer than the one that is known.

    Reads: skin; leaves (leaves,); count; the point x, y, z [m]; best: a known vertex, nearest: its squared distance
        [m^2].
    Returns: the vertex, and its squared distance [m^2].
    """
    body, leaf_start, leaf_vertices, leaf_box = skin.body, skin.leaf_start, skin.leaf_vertices, skin.leaf_box
    zero = np.float32(0)
    for k in range(count):
        b = _index(leaves[k])
        dx = max(max(leaf_box[0, b] - x, x - leaf_box[3, b]), zero)
        dy = max(max(leaf_box[1, b] - y, y - leaf_box[4, b]), zero)
        dz = max(max(leaf_box[2, b] - z, z - leaf_box[5, b]), zero)
        if dx * dx + dy * dy + dz * dz >= nearest:
            continue
        for corner in range(leaf_start[b], leaf_start[b + _index(1)]):
            v = _index(leaf_vertices[_index(corner)])
            dx, dy, dz = body[v, 0] - x, body[v, 1] - y, body[v, 2] - z
            distance = dx * dx + dy * dy + dz * dz
            if distance < nearest:
                best, nearest = np.int64(v), distance
    return best, nearest


@kernel
def seek(skin, limb, x, y, z, best, nearest, buffers):
    """Finds the vertex of one limb, or (limb < 0) of the whole body, that is nearest to a point.

    Reads: skin; limb; the point x, y, z [m]; best, nearest: a known vertex and its squared distance, or -1 and the
        square of the search radius [m^2].
    Writes: buffers, of `search_buffers`.
    Returns: the vertex, -1 for none, and its squared distance [m^2].
    """
    count = list_leaves(skin, limb, (x, y, z), (x, y, z), nearest, buffers)
    return nearest_vertex(skin, buffers[2], count, x, y, z, best, nearest)


@kernel
def seek_place(skin, limb, face, x, y, z, buffers):
    """Finds the place of the surface nearest to a point, around the vertex that `seek` finds.

    Reads: skin; limb; face: one of that limb, the nearer the better; the point x, y, z [m].
    Writes: buffers, of `search_buffers`.
    Returns: face, two weights and squared distance, as `walk` returns them.
    """
    best, nearest = nearest_corner(skin, face, x, y, z)
    vertex, _ = seek(skin, limb, x, y, z, best, nearest, buffers)
    return walk(skin, np.int64(skin.ring[skin.ring_start[vertex]]), np.int64(MOST_STEPS), x, y, z)


@kernel
def seek_block(skin, limb, points, which, faces, count, buffers, vertices_out):
    """Finds the nearest vertex, as `seek` does, for up to eight points that are near to each other and share leaves.

    Reads: skin; limb; points (verts, 3) [m]; which[:count]: those to search for; faces[:count]: a face of the limb for
        each, the nearer the better.
    Writes: buffers, of `search_buffers`; vertices_out[:count].
    """
    far, reach, lanes = np.float32(np.inf), np.float32(0), np.zeros((ROWS, LANES), np.float32)
    lx, ly, lz, hx, hy, hz = far, far, far, -far, -far, -far
    for k in range(count):
        i = _index(which[k])
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        lx, ly, lz, hx, hy, hz = min(lx, x), min(ly, y), min(lz, z), max(hx, x), max(hy, y), max(hz, z)
        vertex, squared = nearest_corner(skin, faces[k], x, y, z)
        lanes[0, k], lanes[1, k], lanes[2, k], lanes[SQUARED, k], lanes[VERTEX, k] = (
            x,
            y,
            z,
            squared,
            np.float32(vertex),
        )
        reach = max(reach, squared)
    near = list_leaves(skin, limb, (lx, ly, lz), (hx, hy, hz), reach, buffers)
    nearest_of_leaves(skin, buffers[2], near, lanes)
    for k in range(count):
        vertices_out[k] = np.int64(lanes[VERTEX, k])


@kernel(forceinline=True)
def some_face(skin, limb):
    """Finds a face of a limb.

    Reads: skin; limb.
    Returns: The face; 0 where the limb has none.
    """
    for leaf in range(len(skin.leaf_limb)):
        if skin.leaf_limb[leaf] == limb:
            return np.int64(leaf * LEAF)
    return np.int64(0)


@kernel(forceinline=True)
def face_of_limb(skin, vertex, limb):
    """Finds a face of a limb around a vertex; a search of that limb may find the vertex.

    Reads: skin; vertex; limb.
    Returns: The face, or -1.
    """
    v = _index(vertex)
    for k in range(skin.ring_start[v], skin.ring_start[v + _index(1)]):
        face = np.int64(skin.ring[_index(k)])
        if skin.leaf_limb[face // LEAF] == limb:
            return face
    return np.int64(-1)
