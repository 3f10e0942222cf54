"""Nearest places on a posed body's surface: compiled code.

A walk from vertex to vertex follows a point from frame to frame; a search over patches finds the nearest vertex of the
whole body, or of one limb. Around that vertex the nearest point of its incident faces is taken, with the normal
blended from their corners.
"""

import numpy as np

from hemline.compiled import kernel

_index = np.uintp


@kernel(forceinline=True)
def squared_distance(body, vertex, x, y, z):
    """Squared distance of a point to a vertex [m^2]."""
    v = _index(vertex)
    dx, dy, dz = body[v, 0] - x, body[v, 1] - y, body[v, 2] - z
    return dx * dx + dy * dy + dz * dz


@kernel(forceinline=True)
def walk(body, ring_start, ring, start, x, y, z):
    """Vertex reached from `start` by going to the neighbour nearest to a point while that is nearer."""
    best, nearest = np.int64(start), squared_distance(body, start, x, y, z)
    while True:
        here = best
        for k in range(ring_start[_index(here)], ring_start[_index(here) + _index(1)]):
            other = ring[_index(k), 0]
            distance = squared_distance(body, other, x, y, z)
            if distance < nearest:
                best, nearest = np.int64(other), distance
        if best == here:
            return best, nearest


@kernel
def vertex_normal(body, ring_start, ring, vertex, known, normals_out):
    """Area-weighted unit normal of a vertex, computed when first asked for. in and out: known, normals_out (verts,3)."""
    v = _index(vertex)
    if known[v]:
        return
    x, y, z = body[v, 0], body[v, 1], body[v, 2]
    nx, ny, nz = np.float32(0), np.float32(0), np.float32(0)
    for k in range(ring_start[v], ring_start[v + _index(1)]):
        b, c = _index(ring[_index(k), 0]), _index(ring[_index(k), 1])
        bx, by, bz = body[b, 0] - x, body[b, 1] - y, body[b, 2] - z
        cx, cy, cz = body[c, 0] - x, body[c, 1] - y, body[c, 2] - z
        nx, ny, nz = nx + by * cz - bz * cy, ny + bz * cx - bx * cz, nz + bx * cy - by * cx
    scale = np.float32(1) / max(np.sqrt(nx * nx + ny * ny + nz * nz), np.float32(1e-20))
    normals_out[v, 0], normals_out[v, 1], normals_out[v, 2] = nx * scale, ny * scale, nz * scale
    known[v] = True


@kernel
def nearest_weights(a, b, c):
    """Barycentric weights (of b and of c) of the point of the triangle a, b, c nearest to the origin.

    Source: Ericson, "Real-Time Collision Detection", 2005, section 5.1.5.
    """
    zero, one = np.float32(0), np.float32(1)
    abx, aby, abz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    acx, acy, acz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    d1 = -(abx * a[0] + aby * a[1] + abz * a[2])
    d2 = -(acx * a[0] + acy * a[1] + acz * a[2])
    if d1 <= 0 and d2 <= 0:
        return zero, zero
    d3 = -(abx * b[0] + aby * b[1] + abz * b[2])
    d4 = -(acx * b[0] + acy * b[1] + acz * b[2])
    if d3 >= 0 and d4 <= d3:
        return one, zero
    vc = d1 * d4 - d3 * d2
    if vc <= 0 and d1 >= 0 and d3 <= 0:
        return d1 / (d1 - d3), zero
    d5 = -(abx * c[0] + aby * c[1] + abz * c[2])
    d6 = -(acx * c[0] + acy * c[1] + acz * c[2])
    if d6 >= 0 and d5 <= d6:
        return zero, one
    vb = d5 * d2 - d1 * d6
    if vb <= 0 and d2 >= 0 and d6 <= 0:
        return zero, d2 / (d2 - d6)
    va = d3 * d6 - d5 * d4
    if va <= 0 and d4 - d3 >= 0 and d5 - d6 >= 0:
        share = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        return one - share, share
    scale = one / max(va + vb + vc, np.float32(1e-30))
    return vb * scale, vc * scale


@kernel
def surface_place(body, ring_start, ring, vertex, x, y, z, known, normals, place_out):
    """Nearest point of the faces around a vertex, and the blended normal there.

    in and out: known (verts,), normals (verts,3); out: place_out (7,): point, unit normal, signed distance [m].
    """
    v = _index(vertex)
    a = (body[v, 0] - x, body[v, 1] - y, body[v, 2] - z)
    nearest, best, at_b, at_c = np.float32(np.inf), np.int64(-1), np.float32(0), np.float32(0)
    px, py, pz = a
    for k in range(ring_start[v], ring_start[v + _index(1)]):
        i, j = _index(ring[_index(k), 0]), _index(ring[_index(k), 1])
        b = (body[i, 0] - x, body[i, 1] - y, body[i, 2] - z)
        c = (body[j, 0] - x, body[j, 1] - y, body[j, 2] - z)
        s, t = nearest_weights(a, b, c)
        r = np.float32(1) - s - t
        cx, cy, cz = r * a[0] + s * b[0] + t * c[0], r * a[1] + s * b[1] + t * c[1], r * a[2] + s * b[2] + t * c[2]
        distance = cx * cx + cy * cy + cz * cz
        if distance < nearest:
            nearest, best, at_b, at_c, px, py, pz = distance, np.int64(k), s, t, cx, cy, cz
    vertex_normal(body, ring_start, ring, vertex, known, normals)
    nx, ny, nz = normals[v, 0], normals[v, 1], normals[v, 2]
    if best >= 0:
        i, j, r = _index(ring[_index(best), 0]), _index(ring[_index(best), 1]), np.float32(1) - at_b - at_c
        vertex_normal(body, ring_start, ring, i, known, normals)
        vertex_normal(body, ring_start, ring, j, known, normals)
        nx = r * nx + at_b * normals[i, 0] + at_c * normals[j, 0]
        ny = r * ny + at_b * normals[i, 1] + at_c * normals[j, 1]
        nz = r * nz + at_b * normals[i, 2] + at_c * normals[j, 2]
    scale = np.float32(1) / max(np.sqrt(nx * nx + ny * ny + nz * nz), np.float32(1e-20))
    nx, ny, nz = nx * scale, ny * scale, nz * scale
    outward = -(px * nx + py * ny + pz * nz)
    place_out[0], place_out[1], place_out[2] = px + x, py + y, pz + z
    place_out[3], place_out[4], place_out[5] = nx, ny, nz
    place_out[6] = np.sqrt(px * px + py * py + pz * pz) * np.float32(1 if outward >= 0 else -1)


@kernel
def seek(body, leaf_start, leaf_vertices, patch_start, patch_box, patch_limb, limb, x, y, z, bound):
    """Vertex nearest to a point, of one limb or (limb < 0) of the whole body. room: bound (patches,)."""
    closest, first = np.float32(np.inf), np.int64(0)
    for k in range(len(bound)):
        dx = max(patch_box[0, k] - x, x - patch_box[3, k], np.float32(0))
        dy = max(patch_box[1, k] - y, y - patch_box[4, k], np.float32(0))
        dz = max(patch_box[2, k] - z, z - patch_box[5, k], np.float32(0))
        bound[k] = dx * dx + dy * dy + dz * dz
        if (limb < 0 or patch_limb[k] == limb) and bound[k] < closest:
            closest, first = bound[k], k
    best, nearest = np.int64(-1), np.float32(np.inf)
    for turn in range(-1, len(bound)):
        k = first if turn < 0 else turn
        if bound[k] < nearest and (limb < 0 or patch_limb[k] == limb) and (turn < 0 or k != first):
            for leaf in range(patch_start[k], patch_start[k + 1]):
                for j in range(leaf_start[leaf], leaf_start[leaf + 1]):
                    distance = squared_distance(body, leaf_vertices[j], x, y, z)
                    if distance < nearest:
                        best, nearest = np.int64(leaf_vertices[j]), distance
    return best
