"""Ways out for vertices that are free neither where they are nor where they were displaced: compiled code."""

import numpy as np

from hemline.collide.surface.box_kernels import BLOCK, LEAF
from hemline.collide.surface.search_kernels import face_of_limb, search_buffers, seek_place, seek_block, some_face
from hemline.collide.surface.surface_kernels import interpolate_normal, point_on_face, walk
from hemline.compiled import kernel

from .displace_lane_kernels import lift_distance

_index = np.uintp


@kernel
def find_escape_faces(points, ids, bad, limb, skin, anchors, faces_out):
    """A face around the vertex of the body that is nearest to each vertex, and one around the nearest of its own limb.

    in: points (n,3), ids (k,), bad: which of them, ascending; limb (n,) of each vertex; skin; anchors (n,): faces that
    may be near; out: faces_out (bad,2).
    """
    room, ring_start, ring = search_buffers(skin), skin.ring_start, skin.ring
    which, faces, vertices = np.empty(BLOCK, np.int64), np.empty(BLOCK, np.int64), np.empty(BLOCK, np.int64)
    places, begin, near, near_limb = np.empty(BLOCK, np.int64), 0, np.int64(0), np.int32(-1)
    while begin < len(bad):
        end, first = begin, ids[bad[begin]]
        own = limb[first]
        if own != near_limb:
            near, near_limb = some_face(skin, own), own
        while end < len(bad) and ids[bad[end]] // BLOCK == first // BLOCK and limb[ids[bad[end]]] == own:
            which[end - begin] = ids[bad[end]]
            faces[end - begin] = anchors[ids[bad[end]]]
            end += 1
        seek_block(skin, np.int32(-1), points, which, faces, end - begin, room, vertices)
        count = 0
        for k in range(begin, end):
            i, vertex = which[k - begin], vertices[k - begin]
            faces_out[k, 0] = faces_out[k, 1] = ring[ring_start[vertex]]
            if face_of_limb(skin, vertex, own) < 0:
                places[count], which[count] = k, i
                faces[count] = anchors[i] if skin.leaf_limb[anchors[i] // LEAF] == own else near
                count += 1
        seek_block(skin, own, points, which, faces, count, room, vertices)
        for k in range(count):
            faces_out[places[k], 1] = ring[ring_start[vertices[k]]]
            near = face_of_limb(skin, vertices[k], own)
        begin = end


@kernel
def propose_escapes(
    points,
    ids,
    bad,
    faces,
    most_steps,
    own_limb,
    pinch,
    margin,
    gap,
    skin,
    anchors,
    heights,
    signed_out,
    trial_out,
    otherwise_out,
):
    """Where vertices that are still inside could go: over the nearest place of the surface around a face.

    in: points (n,3), ids (k,), bad: which of them, faces (bad,): where to look, most_steps: how far; own_limb: it is of
    the vertex's own limb, try the place moved outward by `pinch` [m]; skin; in and out: anchors, heights (n,);
    signed_out (k,): distance [m]; out: trial_out (bad,3): what to test; otherwise_out (bad,3): outside of the own limb
    only.
    """
    one = np.float32(1)
    for k in range(len(bad)):
        i = _index(ids[bad[k]])
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        face, at_b, at_c, squared = walk(skin, np.int64(faces[k]), np.int64(most_steps), x, y, z)
        cx, cy, cz = point_on_face(skin, face, at_b, at_c)
        nx, ny, nz = interpolate_normal(skin, face, at_b, at_c)
        height = (x - cx) * nx + (y - cy) * ny + (z - cz) * nz
        distance = np.sqrt(squared) * (one if height >= 0 else -one)
        anchors[i], heights[i] = face, distance
        if not own_limb:
            signed_out[bad[k]] = distance
        rise = pinch if own_limb else lift_distance(-abs(distance), margin, gap)
        trial_out[k, 0], trial_out[k, 1], trial_out[k, 2] = cx + rise * nx, cy + rise * ny, cz + rise * nz
        if distance < margin:
            rise = lift_distance(distance, margin, gap)
            x, y, z = cx + rise * nx, cy + rise * ny, cz + rise * nz
        otherwise_out[k, 0], otherwise_out[k, 1], otherwise_out[k, 2] = x, y, z


@kernel
def take_escapes(bad, winding, near, trial, otherwise, displaced_out, still_out):
    """Send vertices where it is free.

    out: displaced_out (k,3); still_out (bad,): which of `bad` it is not free for. Returns how many.
    """
    count = 0
    for k in range(len(bad)):
        is_free = winding[k] == 0 and not near[k]
        for axis in range(3):
            displaced_out[bad[k], axis] = trial[k, axis] if is_free else otherwise[k, axis]
        if not is_free:
            still_out[count] = k
            count += 1
    return count


@kernel
def deepest_penetration(points, ids, inside, signed, anchors, skin):
    """Distance to the skin of the deepest vertex [m]: anchors give upper bounds, the largest of which are looked into.

    in: points (n,3), ids (k,), inside (k,), signed (k,): distances to the anchors' surroundings, anchors (n,); skin.
    """
    room, depth, first = search_buffers(skin), np.float32(0), np.int64(-1)
    for k in range(len(ids)):
        if inside[k] and (first < 0 or abs(signed[k]) > abs(signed[first])):
            first = k
    for turn in range(-1, len(ids)):
        k = first if turn < 0 else turn
        if k >= 0 and inside[k] and abs(signed[k]) > depth:
            i = _index(ids[k])
            x, y, z = points[i, 0], points[i, 1], points[i, 2]
            _, _, _, squared = seek_place(skin, np.int32(-1), anchors[i], x, y, z, room)
            depth = max(depth, min(np.sqrt(squared), abs(signed[k])))
    return depth
