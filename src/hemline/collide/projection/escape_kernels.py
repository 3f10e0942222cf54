"""Compiled: ways out for vertices that are free neither where they are nor where they were displaced."""

import numpy as np

from hemline.collide.surface.box_kernels import BLOCK, LEAF
from hemline.collide.surface.search_kernels import face_of_limb, search_buffers, seek_block, seek_place, some_face
from hemline.collide.surface.surface_kernels import interpolate_normal, point_on_face, walk
from hemline.compiled import kernel

from .displace_lane_kernels import lift_distance

_index = np.uintp
PINCH_OFFSET = np.float32(0.002)
"""Distance by which a place on the own limb is moved outward before it is tested for being inside another part [m]."""


@kernel
def find_escape_faces(points, anchors, skin, ids, blocked, limb, faces_out):
    """Finds a face next to the body vertex nearest to each blocked vertex, and one next to the nearest of its own limb.

    Reads: points (verts, 3) [m]; anchors (verts,): faces that may be near; skin; ids (near,): vertices; blocked
        (blocked,): places in `ids`, ascending; limb (verts,) of each vertex.
    Writes: faces_out (blocked, 2): face near any skin, face near the own limb.
    """
    buffers, ring_start, ring = search_buffers(skin), skin.ring_start, skin.ring
    which, faces, vertices = np.empty(BLOCK, np.int64), np.empty(BLOCK, np.int64), np.empty(BLOCK, np.int64)
    places, begin, near, near_limb = np.empty(BLOCK, np.int64), 0, np.int64(0), np.int32(-1)
    while begin < len(blocked):
        end, first = begin, ids[blocked[begin]]
        own = limb[first]
        if own != near_limb:
            near, near_limb = some_face(skin, own), own
        while end < len(blocked) and ids[blocked[end]] // BLOCK == first // BLOCK and limb[ids[blocked[end]]] == own:
            which[end - begin] = ids[blocked[end]]
            faces[end - begin] = anchors[ids[blocked[end]]]
            end += 1
        seek_block(skin, np.int32(-1), points, which, faces, end - begin, buffers, vertices)
        count = 0
        for k in range(begin, end):
            i, vertex = which[k - begin], vertices[k - begin]
            faces_out[k, 0] = faces_out[k, 1] = ring[ring_start[vertex]]
            if face_of_limb(skin, vertex, own) < 0:
                places[count], which[count] = k, i
                faces[count] = anchors[i] if skin.leaf_limb[anchors[i] // LEAF] == own else near
                count += 1
        seek_block(skin, own, points, which, faces, count, buffers, vertices)
        for k in range(count):
            faces_out[places[k], 1] = ring[ring_start[vertices[k]]]
            near = face_of_limb(skin, vertices[k], own)
        begin = end


@kernel
def propose_escapes(cloth, skin, vertices, faces, most_steps, own_limb, distances, out):
    """Proposes a way out for blocked vertices: over the nearest place of the surface around a face.

    Reads: cloth; skin; vertices (blocked,); faces (blocked,): where the walk of each begins; most_steps: its length at
        most; own_limb: whether the faces are of the vertices' own limbs. Then the trial is the nearest place, moved
        outward by `PINCH_OFFSET`, which tells whether the vertex is pinched; distances: `LiftDistances`.
    Writes: out: `Escapes`; the cloth's anchors and heights.
    """
    margin, gap, trials_out, fallbacks_out = distances.margin, distances.gap, out.trials, out.fallbacks
    points, anchors, heights = cloth.points, cloth.anchors, cloth.heights
    one = np.float32(1)
    for k in range(len(vertices)):
        i = _index(vertices[k])
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        face, at_b, at_c, squared = walk(skin, np.int64(faces[k]), np.int64(most_steps), x, y, z)
        cx, cy, cz = point_on_face(skin, face, at_b, at_c)
        nx, ny, nz = interpolate_normal(skin, face, at_b, at_c)
        height = (x - cx) * nx + (y - cy) * ny + (z - cz) * nz
        distance = np.sqrt(squared) * (one if height >= 0 else -one)
        anchors[i], heights[i] = face, distance
        rise = PINCH_OFFSET if own_limb else lift_distance(-abs(distance), margin, gap)
        trials_out[k, 0], trials_out[k, 1], trials_out[k, 2] = cx + rise * nx, cy + rise * ny, cz + rise * nz
        if distance < margin:
            rise = lift_distance(distance, margin, gap)
            x, y, z = cx + rise * nx, cy + rise * ny, cz + rise * nz
        fallbacks_out[k, 0], fallbacks_out[k, 1], fallbacks_out[k, 2] = x, y, z


@kernel
def take_escapes(blocked, winding, touching, escapes, positions_out, remaining_out):
    """Moves blocked vertices to their trial position where that is free, else to their fallback.

    Reads: blocked (blocked,): places in the list of vertices near the skin; winding and touching (blocked,): the test
        of the trials; escapes: of `propose_escapes`.
    Writes: positions_out (near, 3) [m]; remaining_out (blocked,): places in `blocked` of those whose trial is not free.
    Returns: how many remain.
    """
    count, trials, fallbacks = 0, escapes.trials, escapes.fallbacks
    for k in range(len(blocked)):
        is_free = winding[k] == 0 and not touching[k]
        for axis in range(3):
            positions_out[blocked[k], axis] = trials[k, axis] if is_free else fallbacks[k, axis]
        if not is_free:
            remaining_out[count] = k
            count += 1
    return count


@kernel
def deepest_penetration(points, anchors, skin, ids, inside, signed):
    """Returns the distance to the skin of the deepest vertex inside [m].

    Distances around anchors are upper bounds; the exact distance is searched for where they are largest.

    Reads: points (verts, 3) [m]; anchors (verts,); skin; ids (near,): vertices; inside (near,): whether each is inside;
        signed (near,): distances around the anchors [m].
    """
    buffers, depth, first = search_buffers(skin), np.float32(0), np.int64(-1)
    for k in range(len(ids)):
        if inside[k] and (first < 0 or abs(signed[k]) > abs(signed[first])):
            first = k
    for turn in range(-1, len(ids)):
        k = first if turn < 0 else turn
        if k >= 0 and inside[k] and abs(signed[k]) > depth:
            i = _index(ids[k])
            x, y, z = points[i, 0], points[i, 1], points[i, 2]
            _, _, _, squared = seek_place(skin, np.int32(-1), anchors[i], x, y, z, buffers)
            depth = max(depth, min(np.sqrt(squared), abs(signed[k])))
    return depth
