"""Compiled: the nearest place on a posed body's surface, by a walk from face to face.

The walk follows a point from frame to frame; `search_kernels` searches the whole surface.
"""

from typing import NamedTuple

import numpy as np

from hemline.arrays import Bool, Faces, Float, Int, Normals, Vertices
from hemline.compiled import kernel

_index = np.uintp
MOST_STEPS = 100
"""Faces that a walk passes, at most."""


class SkinPatches(NamedTuple):
    """The skin of a body in one frame, as kernels read it: the arrays of `patches.Patches`, and vertices."""

    body: Vertices
    """Renumbered vertices in the frame of the key bone, float32 [m]."""
    faces: Faces
    """Triangles, eight a leaf."""
    across: Int[np.ndarray, "faces 3"]
    """The face over each edge ab, bc, ca."""
    ring_start: Int[np.ndarray, " verts+1"]
    """Where each vertex's faces begin in `ring`."""
    ring: Int[np.ndarray, " corners"]
    """Faces around each vertex."""
    leaf_start: Int[np.ndarray, " leaves+1"]
    """Where each leaf's vertices begin in `leaf_vertices`."""
    leaf_vertices: Int[np.ndarray, " corners"]
    """Vertices of each leaf, each once."""
    leaf_box: Float[np.ndarray, "6 leaves"]
    """Three lowest, then three highest coordinates of each leaf [m]."""
    patch_start: Int[np.ndarray, " patches+1"]
    """Where each patch's leaves begin."""
    patch_box: Float[np.ndarray, "6 patches"]
    """Three lowest, then three highest coordinates of each patch [m]."""
    patch_limb: Int[np.ndarray, " patches"]
    """Limb that each patch belongs to."""
    leaf_limb: Int[np.ndarray, " leaves"]
    """Limb that each leaf belongs to."""
    known: Bool[np.ndarray, " verts"]
    """Vertices whose normal was computed in this frame; kernels write to it."""
    normals: Normals
    """Unit normals of the vertices in `known`; kernels write to it."""


@kernel(forceinline=True)
def nearest_weights(a, b, c):
    """Finds the point of the triangle a, b, c nearest to the origin.

    It works in the precision of its arguments, float32 in real time, and about the origin, so that no digits are lost
    far from it. `meshes.closest_kernels.corner_weights` and `sim.contact.body.touch_kernels.closest_on_triangle` do the
    same in float64.

    Reads: corners a, b, c as tuples of three [m].
    Returns: the barycentric weights of b and of c.

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
        weight = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        return one - weight, weight
    scale = one / max(va + vb + vc, np.float32(1e-30))
    return vb * scale, vc * scale


@kernel(forceinline=True)
def walk(skin, start, most_steps, x, y, z):
    """Walks from face to face towards a point, each time across the edge or corner that is nearest to it.

    A face that lies wholly beyond the plane through the nearest place, square to the direction of the point, is
    skipped.

    Reads: skin; start: a face; most_steps; the point x, y, z [m].
    Returns: the last face, the weights of its second and third corner at the nearest place, squared distance [m^2].
    """
    body, faces, across, ring_start, ring = skin.body, skin.faces, skin.across, skin.ring_start, skin.ring
    best, at_b, at_c, nearest = np.int64(start), np.float32(0), np.float32(0), np.float32(np.inf)
    begin, end, over_edge = np.int64(0), np.int64(1), False
    vertex, edge = _index(0), _index(0)
    nx, ny, nz = np.float32(0), np.float32(0), np.float32(0)
    hx, hy, hz, beyond = nx, ny, nz, nx
    for step in range(most_steps):
        here, before = best, nearest
        for k in range(begin, end):
            if step == 0:
                face = here
            elif over_edge:
                face = np.int64(across[_index(here), edge])
            else:
                face = np.int64(ring[_index(k)])
            i, j, l = _index(faces[_index(face), 0]), _index(faces[_index(face), 1]), _index(faces[_index(face), 2])
            a = (body[i, 0] - x, body[i, 1] - y, body[i, 2] - z)
            b = (body[j, 0] - x, body[j, 1] - y, body[j, 2] - z)
            c = (body[l, 0] - x, body[l, 1] - y, body[l, 2] - z)
            if step > 0:
                over_a = a[0] * hx + a[1] * hy + a[2] * hz
                over_b = b[0] * hx + b[1] * hy + b[2] * hz
                over_c = c[0] * hx + c[1] * hy + c[2] * hz
                if min(over_a, over_b, over_c) >= beyond:
                    continue
            s, t = nearest_weights(a, b, c)
            r = np.float32(1) - s - t
            px, py, pz = r * a[0] + s * b[0] + t * c[0], r * a[1] + s * b[1] + t * c[1], r * a[2] + s * b[2] + t * c[2]
            distance = px * px + py * py + pz * pz
            if distance < nearest:
                best, at_b, at_c, nearest = face, s, t, distance
                nx, ny, nz = px, py, pz
        if nearest >= before * np.float32(0.999999):
            break
        hx, hy, hz, beyond = nx, ny, nz, nearest * np.float32(0.99999)
        at_a = np.float32(1) - at_b - at_c
        on_a, on_b, on_c = at_a > np.float32(1e-6), at_b > 0, at_c > 0
        if on_a and on_b and on_c:
            break
        over_edge = (on_a and on_b) or (on_b and on_c) or (on_a and on_c)
        if over_edge:
            edge = _index(0 if not on_c else 1 if not on_a else 2)
            begin, end = 0, 1
        else:
            vertex = _index(faces[_index(best), _index(0 if on_a else 1 if on_b else 2)])
            begin, end = np.int64(ring_start[vertex]), np.int64(ring_start[vertex + _index(1)])
    return best, at_b, at_c, nearest


@kernel
def vertex_normal(body, faces, ring_start, ring, vertex, known, normals_out):
    """Computes the area-weighted unit normal of a vertex.

    Reads: body (body_verts, 3) [m]; faces (faces, 3); ring_start, ring: faces around each vertex; vertex.
    Writes: known (body_verts,), normals_out (body_verts, 3).
    """
    v = _index(vertex)
    nx, ny, nz = np.float32(0), np.float32(0), np.float32(0)
    for k in range(ring_start[v], ring_start[v + _index(1)]):
        f = _index(ring[_index(k)])
        a, b, c = _index(faces[f, 0]), _index(faces[f, 1]), _index(faces[f, 2])
        x, y, z = body[a, 0], body[a, 1], body[a, 2]
        bx, by, bz = body[b, 0] - x, body[b, 1] - y, body[b, 2] - z
        cx, cy, cz = body[c, 0] - x, body[c, 1] - y, body[c, 2] - z
        nx, ny, nz = nx + by * cz - bz * cy, ny + bz * cx - bx * cz, nz + bx * cy - by * cx
    scale = np.float32(1) / max(np.sqrt(nx * nx + ny * ny + nz * nz), np.float32(1e-20))
    normals_out[v, 0], normals_out[v, 1], normals_out[v, 2] = nx * scale, ny * scale, nz * scale
    known[v] = True


@kernel(forceinline=True)
def interpolate_normal(skin, face, at_b, at_c):
    """Interpolates the unit normal at a place of a face from its corners.

    Reads: skin; face; at_b, at_c: weights of its second and third corner.
    Writes: the skin's normals that were not known yet.
    Returns: the three coordinates of the normal.
    """
    faces, known, normals = skin.faces, skin.known, skin.normals
    f = _index(face)
    i, j, k = _index(faces[f, 0]), _index(faces[f, 1]), _index(faces[f, 2])
    for vertex in (i, j, k):
        if not known[vertex]:
            vertex_normal(skin.body, faces, skin.ring_start, skin.ring, vertex, known, normals)
    at_a = np.float32(1) - at_b - at_c
    nx = at_a * normals[i, 0] + at_b * normals[j, 0] + at_c * normals[k, 0]
    ny = at_a * normals[i, 1] + at_b * normals[j, 1] + at_c * normals[k, 1]
    nz = at_a * normals[i, 2] + at_b * normals[j, 2] + at_c * normals[k, 2]
    scale = np.float32(1) / max(np.sqrt(nx * nx + ny * ny + nz * nz), np.float32(1e-20))
    return nx * scale, ny * scale, nz * scale


@kernel(forceinline=True)
def point_on_face(skin, face, at_b, at_c):
    """Computes the position of a place of a face.

    Reads: skin; face; at_b, at_c: weights of its second and third corner.
    Returns: The three coordinates [m].
    """
    body, faces = skin.body, skin.faces
    f = _index(face)
    i, j, k, at_a = _index(faces[f, 0]), _index(faces[f, 1]), _index(faces[f, 2]), np.float32(1) - at_b - at_c
    x = at_a * body[i, 0] + at_b * body[j, 0] + at_c * body[k, 0]
    y = at_a * body[i, 1] + at_b * body[j, 1] + at_c * body[k, 1]
    z = at_a * body[i, 2] + at_b * body[j, 2] + at_c * body[k, 2]
    return x, y, z


@kernel
def height_over(skin, face, at_b, at_c, x, y, z):
    """Computes the height of a point over a place of a face, along the normal there.

    Reads: skin; face; at_b, at_c: weights of its second and third corner; x, y, z: the point [m].
    Returns: The height [m].
    """
    cx, cy, cz = point_on_face(skin, face, at_b, at_c)
    nx, ny, nz = interpolate_normal(skin, face, at_b, at_c)
    return (x - cx) * nx + (y - cy) * ny + (z - cz) * nz


@kernel(forceinline=True)
def plane_height(skin, face, x, y, z):
    """Computes the height of a point over the plane of a face.

    Reads: skin; face; x, y, z: the point [m].
    Returns: The height [m].
    """
    body, faces = skin.body, skin.faces
    f = _index(face)
    i, j, k = _index(faces[f, 0]), _index(faces[f, 1]), _index(faces[f, 2])
    ax, ay, az = body[i, 0], body[i, 1], body[i, 2]
    bx, by, bz = body[j, 0] - ax, body[j, 1] - ay, body[j, 2] - az
    cx, cy, cz = body[k, 0] - ax, body[k, 1] - ay, body[k, 2] - az
    nx, ny, nz = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
    scale = np.float32(1) / max(np.sqrt(nx * nx + ny * ny + nz * nz), np.float32(1e-20))
    return ((x - ax) * nx + (y - ay) * ny + (z - az) * nz) * scale
