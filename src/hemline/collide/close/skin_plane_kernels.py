"""Compiled: a half-space over the skin for each vertex of close-fitting cloth, found anew in every frame.

Nothing is remembered from frame to frame, so that cloth which stands still does not move, and no vertex is held off by
skin of another limb that was near it once. All positions are in the frame of the key bone.
"""

from typing import NamedTuple

import numpy as np

from hemline.arrays import Bool, Float, Int
from hemline.collide.surface.box_kernels import BLOCK
from hemline.collide.surface.search_kernels import list_leaves, search_buffers
from hemline.collide.surface.search_lane_kernels import LANES, ROWS, SQUARED, VERTEX, nearest_of_leaves
from hemline.collide.surface.surface_kernels import interpolate_normal, plane_height, point_on_face, vertex_normal, walk
from hemline.compiled import kernel

_index = np.uintp
SEARCH_STEPS = 12
"""Faces that a walk passes from the nearest vertex to the nearest face, at most."""
OWN_DEPTH = np.float32(0.02)
"""A vertex in front of the nearest skin is not taken to be deeper than this in its own limb [m]."""
OWN_STEPS = 2
"""Faces that a walk passes from the nearest vertex that faces the right way, at most."""
FOLLOW_STEPS = 4
"""Faces that a walk passes when a vertex has been moved within a frame, at most."""
LEAST_AGREEMENT = np.float32(0.2)
"""Least cosine between the normal of the skin that a vertex is inside of, and that of its own skin in this pose."""
FOLLOW_DISTANCE = np.float32(0.001)
"""A half-space is set anew where its vertex has been moved farther than this within the frame [m]."""
FAR_SQUARED = np.float32(0.0016)
"""Squared distance from a vertex's own skin above which it is first tested whether any skin is near at all [m^2]."""
FOLLOW_HEIGHT = np.float32(0.012)
"""Vertices higher than this over their plane keep it when they are moved [m]."""


class SkinDistances(NamedTuple):
    """Distances that decide which half-spaces there are [m]."""

    gap: np.float32
    """Least height of a vertex over the skin."""
    near: np.float32
    """Height over the skin up to which a vertex has a half-space."""
    reach: np.float32
    """Radius in which skin is searched for."""


class SkinPlanes(NamedTuple):
    """The half-spaces of a frame; kernels write to all arrays."""

    planes: Float[np.ndarray, "verts 4"]
    """Unit normal, and least height along it [m]."""
    faces: Int[np.ndarray, " verts"]
    """Face of the skin that each vertex is kept over, or that is nearest; -1 if it is far away."""
    heights: Float[np.ndarray, " verts"]
    """Signed distance to the nearest skin [m], where a face is known."""
    placed: Float[np.ndarray, "verts 3"]
    """Position for which each half-space was set [m]."""
    pinched: Bool[np.ndarray, " verts"]
    """Vertices between limbs that cut through each other; they have no half-space."""
    listed: Int[np.ndarray, " verts"]
    """The vertices that have a half-space come first."""


@kernel(forceinline=True)
def unit_normal(skin, vertex):
    """Returns the three coordinates of the unit normal of a vertex of the skin.

    Reads: skin; vertex.
    Writes: the skin's normal of this vertex if it was not known yet.
    """
    v = _index(vertex)
    if not skin.known[v]:
        vertex_normal(skin.body, skin.faces, skin.ring_start, skin.ring, v, skin.known, skin.normals)
    return skin.normals[v, 0], skin.normals[v, 1], skin.normals[v, 2]


@kernel
def is_outside(skin, homes, points, begin, end):
    """Tells whether all points of a block are in front of their own skin.

    Reads: skin; homes (verts,): vertex of the skin that was next to each point at rest; points (verts, 3) [m]; begin,
        end: the block.
    Returns: Whether they are.
    """
    for k in range(begin, end):
        i, v = _index(k), _index(homes[k])
        nx, ny, nz = unit_normal(skin, v)
        x, y, z = points[i, 0] - skin.body[v, 0], points[i, 1] - skin.body[v, 1], points[i, 2] - skin.body[v, 2]
        if x * nx + y * ny + z * nz <= 0:
            return False
    return True


@kernel
def nearest_agreeing(skin, leaves, count, point, normal, reach):
    """Finds the vertex of leaves[:count] nearest to a point among those whose normal agrees with another one.

    Reads: skin; leaves (leaves,); count; point (3) [m]; normal (3): a unit vector; reach: squared radius [m^2].
    Writes: the skin's normals that were not known yet.
    Returns: The vertex, -1 for none.
    """
    body, leaf_start, leaf_vertices, leaf_box = skin.body, skin.leaf_start, skin.leaf_vertices, skin.leaf_box
    (x, y, z), best, nearest, zero = point, np.int64(-1), reach, np.float32(0)
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
                nx, ny, nz = unit_normal(skin, v)
                if nx * normal[0] + ny * normal[1] + nz * normal[2] > LEAST_AGREEMENT:
                    best, nearest = np.int64(v), distance
    return best


@kernel(forceinline=True)
def set_plane(skin, face, at_b, at_c, gap, i, planes_out):
    """Sets the half-space of a vertex at a place of the skin.

    Reads: skin; face; at_b, at_c: weights of its second and third corner; gap: least height [m]; i: the vertex.
    Writes: planes_out (verts, 4), its row; the skin's normals that were not known yet.
    """
    px, py, pz = point_on_face(skin, face, at_b, at_c)
    nx, ny, nz = interpolate_normal(skin, face, at_b, at_c)
    planes_out[i, 0], planes_out[i, 1], planes_out[i, 2] = nx, ny, nz
    planes_out[i, 3] = nx * px + ny * py + nz * pz + gap


@kernel
def prefer_own(skin, i, home, own, point, distances, buffers, found):
    """Keeps a vertex over the nearest skin that faces like its own, if it is inside there or inside the nearest skin.

    Cloth between two limbs, such as a sleeve between arm and chest, so stays on its own limb as a whole, also where the
    limbs cut through each other and the skin of the other one is nearer.

    Reads: skin; i: the vertex; home: vertex of the skin that was next to it at rest, own (3): the unit normal there;
        point (3): the vertex [m]; distances.
    Writes: found: plane and face of the vertex; buffers; the skin's normals that were not known yet.
    Returns: Whether the vertex is pinched: out of its own limb it would be inside the other one.
    """
    (x, y, z), h = point, _index(home)
    dx, dy, dz = skin.body[h, 0] - x, skin.body[h, 1] - y, skin.body[h, 2] - z
    reach = min(dx * dx + dy * dy + dz * dz, distances.reach * distances.reach) + np.float32(1e-8)
    count = list_leaves(skin, np.int32(-1), point, point, reach, buffers)
    vertex = nearest_agreeing(skin, buffers[2], count, point, own, reach)
    if vertex < 0:
        return False
    start = np.int64(skin.ring[skin.ring_start[_index(vertex)]])
    face, at_b, at_c, _ = walk(skin, start, np.int64(OWN_STEPS), x, y, z)
    px, py, pz = point_on_face(skin, face, at_b, at_c)
    nx, ny, nz = interpolate_normal(skin, face, at_b, at_c)
    height, planes = (x - px) * nx + (y - py) * ny + (z - pz) * nz, found.planes
    if found.heights[i] >= 0 and (height >= distances.gap or height < -OWN_DEPTH):
        return False
    lack = max(distances.gap - height, np.float32(0))
    facing = planes[i, 0] * nx + planes[i, 1] * ny + planes[i, 2] * nz
    found.faces[i] = face
    found.pinched[i] = lack > 0 and found.heights[i] + lack * facing < 0
    if found.pinched[i]:
        return True
    set_plane(skin, face, at_b, at_c, distances.gap, i, planes)
    return False


@kernel
def find_planes(skin, homes, points, distances, found):
    """Finds the half-space of each vertex that is near the skin or inside it, over the skin that is nearest.

    A vertex inside the body, where the nearest skin faces another way than the skin that is the vertex's own at rest,
    is on the wrong side of a limb: the nearest skin that faces the right way takes its place, if one is in reach.

    The search of a vertex is bounded by its own skin and by the skin found for the vertex before it, never by an
    earlier frame.

    Reads: skin; homes (verts,): vertex of the skin that was next to each vertex at rest; points (verts, 3) [m];
        distances: `SkinDistances`.
    Writes: found: `SkinPlanes`; the skin's normals that were not known yet.
    Returns: The number of vertices that have a half-space.
    """
    body, ring_start, ring = skin.body, skin.ring_start, skin.ring
    buffers, other_buffers = search_buffers(skin), search_buffers(skin)
    lanes, placed = np.zeros((ROWS, LANES), np.float32), found.placed
    near, reach, last, count = distances.near * distances.near, distances.reach * distances.reach, np.int64(-1), 0
    whole, far = np.int32(-1), np.float32(np.inf)
    found.pinched[:] = False
    for begin in range(0, len(points), BLOCK):
        end, bound = min(begin + BLOCK, len(points)), np.float32(0)
        lx, ly, lz, hx, hy, hz = far, far, far, -far, -far, -far
        for k in range(end - begin):
            i = _index(begin + k)
            x, y, z, v = points[i, 0], points[i, 1], points[i, 2], _index(homes[i])
            dx, dy, dz = body[v, 0] - x, body[v, 1] - y, body[v, 2] - z
            known, squared = v, dx * dx + dy * dy + dz * dz
            if last >= 0:
                v = _index(last)
                dx, dy, dz = body[v, 0] - x, body[v, 1] - y, body[v, 2] - z
                distance = dx * dx + dy * dy + dz * dz
                if distance < squared:
                    known, squared = v, distance
            lanes[0, k], lanes[1, k], lanes[2, k], lanes[SQUARED, k], lanes[VERTEX, k] = (
                x,
                y,
                z,
                squared,
                np.float32(known),
            )
            bound = max(bound, squared)
            lx, ly, lz, hx, hy, hz = min(lx, x), min(ly, y), min(lz, z), max(hx, x), max(hy, y), max(hz, z)
        low, high = (lx, ly, lz), (hx, hy, hz)
        away = bound > FAR_SQUARED and list_leaves(skin, whole, low, high, near, buffers) == 0
        if away and is_outside(skin, homes, points, begin, end):
            for k in range(begin, end):
                found.faces[_index(k)] = -1
            continue
        leaves = list_leaves(skin, whole, low, high, min(bound, reach), buffers)
        nearest_of_leaves(skin, buffers[2], leaves, lanes)
        for k in range(end - begin):
            i = _index(begin + k)
            x, y, z = points[i, 0], points[i, 1], points[i, 2]
            last = np.int64(lanes[VERTEX, k])
            start = np.int64(ring[ring_start[_index(last)]])
            face, at_b, at_c, squared = walk(skin, start, np.int64(SEARCH_STEPS), x, y, z)
            found.faces[i], found.heights[i] = face, np.sqrt(squared)
            if squared > near and plane_height(skin, face, x, y, z) > 0:
                continue
            set_plane(skin, face, at_b, at_c, distances.gap, i, found.planes)
            placed[i, 0], placed[i, 1], placed[i, 2] = x, y, z
            nx, ny, nz = found.planes[i, 0], found.planes[i, 1], found.planes[i, 2]
            if nx * x + ny * y + nz * z - found.planes[i, 3] + distances.gap < 0:
                found.heights[i] = -found.heights[i]
            elif squared > near:
                continue
            own = unit_normal(skin, homes[i])
            if nx * own[0] + ny * own[1] + nz * own[2] <= LEAST_AGREEMENT and prefer_own(
                skin, i, homes[i], own, (x, y, z), distances, other_buffers, found
            ):
                continue
            found.listed[count] = begin + k
            count += 1
    return count


@kernel
def follow_planes(skin, points, gap, found, count):
    """Moves half-spaces along with vertices that were moved, by a few faces.

    Reads: skin; points (verts, 3) [m]; gap: least height [m]; count: number of vertices that have a half-space.
    Writes: found: planes and faces of `SkinPlanes`; the skin's normals that were not known yet.
    """
    planes, placed = found.planes, found.placed
    for k in range(count):
        i = _index(found.listed[k])
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        dx, dy, dz = x - placed[i, 0], y - placed[i, 1], z - placed[i, 2]
        if dx * dx + dy * dy + dz * dz < FOLLOW_DISTANCE * FOLLOW_DISTANCE:
            continue
        if planes[i, 0] * x + planes[i, 1] * y + planes[i, 2] * z - planes[i, 3] > FOLLOW_HEIGHT:
            continue
        placed[i, 0], placed[i, 1], placed[i, 2] = x, y, z
        face, at_b, at_c, _ = walk(skin, np.int64(found.faces[i]), np.int64(FOLLOW_STEPS), x, y, z)
        nx, ny, nz = interpolate_normal(skin, face, at_b, at_c)
        if nx * planes[i, 0] + ny * planes[i, 1] + nz * planes[i, 2] > LEAST_AGREEMENT:
            found.faces[i] = face
            set_plane(skin, face, at_b, at_c, gap, i, planes)
