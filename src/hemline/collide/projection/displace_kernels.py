"""Displace garment vertices out of the posed body, in order and smoothly: compiled code."""

import numpy as np

from hemline.collide.surface.search_kernels import search_buffers, seek
from hemline.collide.surface.surface_kernels import MOST_STEPS, height_over, plane_height, vertex_normal, walk
from hemline.compiled import kernel

from .displace_lane_kernels import (
    CORNERS,
    LANES,
    NORMALS,
    OFFSET,
    POINT,
    ROWS,
    SQUARED,
    WEIGHTS,
    lift_lanes,
    project_lanes,
)

_index = np.uintp
SLOW_DEPTH = np.float32(0.01)
"""What was displaced from deeper than this goes round a limb slowly, lest it pop from one side to the other [m]."""
SLOW_STEPS = 5
"""Faces that an anchor of such a vertex passes in a frame."""


@kernel(forceinline=True)
def take_corners(body, faces, face, x, y, z, rows_out, lane):
    """The corners of a face, relative to a point, into a lane of the rows."""
    for corner in range(3):
        v = _index(faces[_index(face), _index(corner)])
        row = CORNERS + 3 * corner
        rows_out[row, lane], rows_out[row + 1, lane], rows_out[row + 2, lane] = (
            body[v, 0] - x,
            body[v, 1] - y,
            body[v, 2] - z,
        )


@kernel(forceinline=True)
def take_normals(body, faces, ring_start, ring, known, normals, face, rows_out, lane):
    """The normals at the corners of a face into a lane of the rows."""
    for corner in range(3):
        v, row = _index(faces[_index(face), _index(corner)]), NORMALS + 3 * corner
        if not known[v]:
            vertex_normal(body, faces, ring_start, ring, v, known, normals)
        rows_out[row, lane], rows_out[row + 1, lane], rows_out[row + 2, lane] = (
            normals[v, 0],
            normals[v, 1],
            normals[v, 2],
        )


@kernel
def displace(
    points,
    ids,
    skin,
    places,
    anchors,
    heights,
    offsets,
    decay,
    margin,
    gap,
    far,
    turn,
    displaced_out,
    signed_out,
):
    """Where each listed vertex should go to be outside of the surface around its anchor.

    in: points (n,3), ids (k,), skin; places (n,): faces that vertices were held off from, -1 for none: no farther than
    around them is looked; offsets (n,3) and their decay (0..1); margin, gap [m]; turn: frames, from 1; far [m]:
    vertices that were farther outside, or keep clear of their anchor, are left alone but in every fourth turn; those
    farther inside look for a much shorter way out, and in the first turn all do; in and out: anchors (n,), heights
    (n,): signed distance when last measured; out: displaced_out (k,3), signed_out (k,): signed distance before [m].
    """
    tiny, loyalty, last, room = np.float32(1e-8), np.float32(0.1), np.int64(-1), search_buffers(skin)
    body, faces, ring_start, ring = skin.body, skin.faces, skin.ring_start, skin.ring
    known, normals = skin.known, skin.normals
    rows, stands = np.zeros((ROWS, LANES), np.float32), np.zeros(LANES, np.bool_)
    at_rest = np.zeros(LANES, np.bool_)
    for begin in range(0, len(ids), LANES):
        count = min(LANES, len(ids) - begin)
        for lane in range(count):
            i = _index(ids[begin + lane])
            take_corners(body, faces, anchors[i], points[i, 0], points[i, 1], points[i, 2], rows, lane)
        project_lanes(rows, stands)
        for lane in range(count):
            k = begin + lane
            i = _index(ids[k])
            x, y, z = points[i, 0], points[i, 1], points[i, 2]
            ox, oy, oz = offsets[i, 0] * decay, offsets[i, 1] * decay, offsets[i, 2] * decay
            held = ox * ox + oy * oy + oz * oz > tiny
            rest = heights[i] > 2 * margin and not held and (ids[k] + turn) % 4 != 0
            at_rest[lane] = rest and (heights[i] > far or plane_height(skin, anchors[i], x, y, z) > 2 * margin)
            if at_rest[lane]:
                continue
            placed = places[i] >= 0
            start = np.int64(places[i] if placed else anchors[i])
            slow = placed or (held and heights[i] < -SLOW_DEPTH)
            most_steps = np.int64(SLOW_STEPS if slow else MOST_STEPS)
            if last >= 0 and not slow:
                p, q = _index(faces[_index(last), 0]), _index(faces[_index(start), 0])
                px, py, pz = body[p, 0] - x, body[p, 1] - y, body[p, 2] - z
                qx, qy, qz = body[q, 0] - x, body[q, 1] - y, body[q, 2] - z
                if px * px + py * py + pz * pz < np.float32(0.25) * (qx * qx + qy * qy + qz * qz):
                    start = last
            last, at_b, at_c, squared = start, rows[WEIGHTS, lane], rows[WEIGHTS + 1, lane], rows[SQUARED, lane]
            if not stands[lane] or start != anchors[i]:
                last, at_b, at_c, squared = walk(skin, start, most_steps, x, y, z)
            if not placed and (turn == 1 or squared > far * far):
                deep = (heights[i] > -far and not slow) or (ids[k] + turn) % 16 == 0
                if turn == 1 or (deep and height_over(skin, last, at_b, at_c, x, y, z) < 0):
                    reach = squared * (np.float32(1) if turn == 1 else loyalty)
                    vertex, _ = seek(skin, np.int32(-1), x, y, z, np.int64(-1), reach, room)
                    if vertex >= 0:
                        start = np.int64(ring[ring_start[vertex]])
                        last, at_b, at_c, squared = walk(skin, start, most_steps, x, y, z)
            anchors[i] = last
            take_corners(body, faces, last, np.float32(0), np.float32(0), np.float32(0), rows, lane)
            take_normals(body, faces, ring_start, ring, known, normals, last, rows, lane)
            rows[WEIGHTS, lane], rows[WEIGHTS + 1, lane], rows[SQUARED, lane] = at_b, at_c, squared
            rows[POINT, lane], rows[POINT + 1, lane], rows[POINT + 2, lane] = x, y, z
            rows[OFFSET, lane], rows[OFFSET + 1, lane], rows[OFFSET + 2, lane] = ox, oy, oz
        lift_lanes(rows, margin, gap, tiny)
        for lane in range(count):
            k = begin + lane
            i = _index(ids[k])
            if at_rest[lane]:
                displaced_out[k, 0], displaced_out[k, 1], displaced_out[k, 2] = points[i, 0], points[i, 1], points[i, 2]
                signed_out[k] = heights[i]
                continue
            signed_out[k] = heights[i] = rows[SQUARED, lane]
            for axis in range(3):
                displaced_out[k, axis] = rows[POINT + axis, lane]


@kernel
def list_doubtful(points, ids, displaced, signed, winding, near, offsets, margin, turn, doubtful_out, tests_out):
    """Displaced vertices that may have been free before, and should then have stayed.

    Those that are not free where they went, and those that were taken to be deep inside: the latter only where that is
    new, for what was displaced as far in the last frame is asked again in every fourth turn.

    in: points (n,3), ids (k,), displaced (k,3), signed (k,) distances before, winding and near (k,) of the displaced
    positions, offsets (n,3) of the last frame, margin [m], turn; out: doubtful_out (k,): which, tests_out (k,3): where
    they were. Returns how many.
    """
    count = 0
    for k in range(len(ids)):
        i = _index(ids[k])
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        if displaced[k, 0] == x and displaced[k, 1] == y and displaced[k, 2] == z:
            continue
        if winding[k] == 0 and not near[k]:
            ox, oy, oz = offsets[i, 0], offsets[i, 1], offsets[i, 2]
            known = ox * ox + oy * oy + oz * oz > margin * margin and (ids[k] + turn) % 4 != 0
            if signed[k] >= -margin or known:
                continue
        doubtful_out[count] = k
        tests_out[count, 0], tests_out[count, 1], tests_out[count, 2] = x, y, z
        count += 1
    return count


@kernel
def restore_free(points, ids, winding, near, doubtful, winding_before, near_before, displaced_out, bad_out):
    """Send back what was free before, and list what is free in neither position.

    Free is what has winding number 0 and is not within rounding of the surface.

    in: points (n,3), ids (k,), winding and near (k,) of the displaced positions; doubtful: which of them were asked
    where they were, winding_before and near_before of those; in and out: displaced_out (k,3); out: bad_out (k,).
    Returns how many bad.
    """
    count, asked = 0, 0
    for k in range(len(ids)):
        is_free = winding[k] == 0 and not near[k]
        if asked < len(doubtful) and doubtful[asked] == k:
            if winding_before[asked] == 0 and not near_before[asked]:
                is_free = True
                for axis in range(3):
                    displaced_out[k, axis] = points[_index(ids[k]), axis]
            asked += 1
        if not is_free:
            bad_out[count] = k
            count += 1
    return count


@kernel
def write_back(points, ids, final, frame, order, offsets_out, lively_out, vertices_out):
    """Write the final positions back into the world, and remember how far each vertex was moved.

    in: points (n,3), ids (k,), final (k,3), frame (3,4): bone to world, order (n,);
    out: offsets_out (n,3) zeroed and set, lively_out (blocks,), vertices_out (n,3). Returns how many moved.
    """
    moved = 0
    offsets_out[:] = 0
    lively_out[:] = False
    for k in range(len(ids)):
        i = _index(ids[k])
        x, y, z = final[k, 0], final[k, 1], final[k, 2]
        dx, dy, dz = x - points[i, 0], y - points[i, 1], z - points[i, 2]
        if dx == 0 and dy == 0 and dz == 0:
            continue
        offsets_out[i, 0], offsets_out[i, 1], offsets_out[i, 2] = dx, dy, dz
        lively_out[ids[k] // 8] = True
        moved += 1
        for axis in range(3):
            vertices_out[order[i], axis] = frame[axis, 0] * x + frame[axis, 1] * y + frame[axis, 2] * z + frame[axis, 3]
    return moved
