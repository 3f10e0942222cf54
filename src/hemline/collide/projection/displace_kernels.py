"""Compiled: garment vertices are displaced out of the posed body, in order and smoothly."""

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
"""A vertex displaced from deeper than this moves around a limb slowly, so that it does not pop to the other side
[m]."""
SLOW_STEPS = 5
"""Faces that the anchor of such a vertex passes in a frame, at most."""


@kernel(forceinline=True)
def take_corners(skin, face, x, y, z, rows_out, lane):
    """Copies the corners of a face, relative to a point, into one lane.

    Reads: skin; face; the point x, y, z [m]; lane.
    Writes: rows_out (ROWS, LANES), its rows of corners [m].
    """
    body, faces = skin.body, skin.faces
    for corner in range(3):
        v = _index(faces[_index(face), _index(corner)])
        row = CORNERS + 3 * corner
        rows_out[row, lane], rows_out[row + 1, lane], rows_out[row + 2, lane] = (
            body[v, 0] - x,
            body[v, 1] - y,
            body[v, 2] - z,
        )


@kernel(forceinline=True)
def take_normals(skin, face, rows_out, lane):
    """Copies the normals at the corners of a face into one lane.

    Reads: skin; face; lane.
    Writes: rows_out (ROWS, LANES), its rows of normals; the skin's normals that were not known yet.
    """
    body, faces, ring_start, ring = skin.body, skin.faces, skin.ring_start, skin.ring
    known, normals = skin.known, skin.normals
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
def displace(cloth, skin, ids, decay, distances, turn, positions_out, signed_out):
    """Proposes where each listed vertex should go to be outside of the surface around its anchor.

    A vertex that was farther outside than `distances.far`, or that keeps clear of its anchor, is measured in every
    fourth turn only. For a vertex farther inside than that, the kernel searches for a much shorter way out; in the
    first turn, for all.
    A vertex with a place of contact is only measured around that place.

    Reads: cloth; skin; ids (near,): vertices; decay: the factor of last frame's offsets, 0 to 1; distances:
        `LiftDistances`; turn: frame number from 1.
    Writes: positions_out (near, 3) [m]; signed_out (near,): signed distances before [m]; the cloth's anchors and
        heights; the skin's normals.
    """
    points, places, anchors = cloth.points, cloth.places, cloth.anchors
    heights, offsets = cloth.heights, cloth.offsets
    margin, gap, far = distances
    tiny, loyalty, last, buffers = np.float32(1e-8), np.float32(0.1), np.int64(-1), search_buffers(skin)
    body, faces, ring_start, ring = skin.body, skin.faces, skin.ring_start, skin.ring
    rows, stands = np.zeros((ROWS, LANES), np.float32), np.zeros(LANES, np.bool_)
    skipped = np.zeros(LANES, np.bool_)
    for begin in range(0, len(ids), LANES):
        count = min(LANES, len(ids) - begin)
        for lane in range(count):
            i = _index(ids[begin + lane])
            take_corners(skin, anchors[i], points[i, 0], points[i, 1], points[i, 2], rows, lane)
        project_lanes(rows, stands)
        for lane in range(count):
            k = begin + lane
            i = _index(ids[k])
            x, y, z = points[i, 0], points[i, 1], points[i, 2]
            ox, oy, oz = offsets[i, 0] * decay, offsets[i, 1] * decay, offsets[i, 2] * decay
            moved_before = ox * ox + oy * oy + oz * oz > tiny
            far_off = heights[i] > 2 * margin and not moved_before and (ids[k] + turn) % 4 != 0
            skipped[lane] = far_off and (heights[i] > far or plane_height(skin, anchors[i], x, y, z) > 2 * margin)
            if skipped[lane]:
                continue
            in_contact = places[i] >= 0
            start = np.int64(places[i] if in_contact else anchors[i])
            slow = in_contact or (moved_before and heights[i] < -SLOW_DEPTH)
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
            if not in_contact and (turn == 1 or squared > far * far):
                deep = (heights[i] > -far and not slow) or (ids[k] + turn) % 16 == 0
                if turn == 1 or (deep and height_over(skin, last, at_b, at_c, x, y, z) < 0):
                    reach = squared * (np.float32(1) if turn == 1 else loyalty)
                    vertex, _ = seek(skin, np.int32(-1), x, y, z, np.int64(-1), reach, buffers)
                    if vertex >= 0:
                        start = np.int64(ring[ring_start[vertex]])
                        last, at_b, at_c, squared = walk(skin, start, most_steps, x, y, z)
            anchors[i] = last
            take_corners(skin, last, np.float32(0), np.float32(0), np.float32(0), rows, lane)
            take_normals(skin, last, rows, lane)
            rows[WEIGHTS, lane], rows[WEIGHTS + 1, lane], rows[SQUARED, lane] = at_b, at_c, squared
            rows[POINT, lane], rows[POINT + 1, lane], rows[POINT + 2, lane] = x, y, z
            rows[OFFSET, lane], rows[OFFSET + 1, lane], rows[OFFSET + 2, lane] = ox, oy, oz
        lift_lanes(rows, margin, gap, tiny)
        for lane in range(count):
            k = begin + lane
            i = _index(ids[k])
            if skipped[lane]:
                positions_out[k, 0], positions_out[k, 1], positions_out[k, 2] = points[i, 0], points[i, 1], points[i, 2]
                signed_out[k] = heights[i]
                continue
            signed_out[k] = heights[i] = rows[SQUARED, lane]
            for axis in range(3):
                positions_out[k, axis] = rows[POINT + axis, lane]


@kernel
def list_doubtful(points, offsets, ids, proposal, margin, turn, doubtful_out, tests_out):
    """Lists displaced vertices that may have been free where they were, and should then have stayed.

    These are vertices whose proposed position is not free, and vertices that were taken to be deep inside. The latter
    are listed only where that is new: one displaced as far in the last frame is tested again in every fourth turn.

    Reads: points, offsets (verts, 3) of `Cloth` [m]; ids (near,): vertices; proposal; margin [m]; turn: frame number.
    Writes: doubtful_out (near,): places in `ids`; tests_out (near, 3): where these vertices were [m].
    Returns: how many are listed.
    """
    displaced, signed, winding, touching = proposal.positions, proposal.signed, proposal.winding, proposal.touching
    count = 0
    for k in range(len(ids)):
        i = _index(ids[k])
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        if displaced[k, 0] == x and displaced[k, 1] == y and displaced[k, 2] == z:
            continue
        if winding[k] == 0 and not touching[k]:
            ox, oy, oz = offsets[i, 0], offsets[i, 1], offsets[i, 2]
            known = ox * ox + oy * oy + oz * oz > margin * margin and (ids[k] + turn) % 4 != 0
            if signed[k] >= -margin or known:
                continue
        doubtful_out[count] = k
        tests_out[count, 0], tests_out[count, 1], tests_out[count, 2] = x, y, z
        count += 1
    return count


@kernel
def restore_free(points, ids, proposal, doubtful, winding_before, touching_before, blocked_out):
    """Puts vertices back that were free before, and lists those that are free in neither position.

    A position is free if its winding number is 0 and it is not within rounding of the surface.

    Reads: points (verts, 3) [m]; ids (near,): vertices; proposal; doubtful (doubtful,): places in `ids`; winding_before
        and touching_before (doubtful,): the test of where these vertices were.
    Writes: the proposal's positions; blocked_out (near,): places in `ids`.
    Returns: how many are blocked.
    """
    positions, winding, touching = proposal.positions, proposal.winding, proposal.touching
    count, tested = 0, 0
    for k in range(len(ids)):
        is_free = winding[k] == 0 and not touching[k]
        if tested < len(doubtful) and doubtful[tested] == k:
            if winding_before[tested] == 0 and not touching_before[tested]:
                is_free = True
                for axis in range(3):
                    positions[k, axis] = points[_index(ids[k]), axis]
            tested += 1
        if not is_free:
            blocked_out[count] = k
            count += 1
    return count


@kernel
def write_back(points, ids, positions, to_world, order, offsets_out, displaced_out, vertices_out):
    """Writes the final positions back into the world, and how far each vertex was moved.

    Reads: points (verts, 3) [m]; ids (near,); positions (near, 3): final ones [m]; to_world (3, 4): the bone's frame to
        the world; order (verts,): the projector's order to the garment's own.
    Writes: offsets_out (verts, 3) [m], zeroed first; displaced_out (blocks,): blocks with a moved vertex; vertices_out
        (verts, 3) in the world [m].
    Returns: how many vertices were moved.
    """
    moved = 0
    offsets_out[:] = 0
    displaced_out[:] = False
    for k in range(len(ids)):
        i = _index(ids[k])
        x, y, z = positions[k, 0], positions[k, 1], positions[k, 2]
        dx, dy, dz = x - points[i, 0], y - points[i, 1], z - points[i, 2]
        if dx == 0 and dy == 0 and dz == 0:
            continue
        offsets_out[i, 0], offsets_out[i, 1], offsets_out[i, 2] = dx, dy, dz
        displaced_out[ids[k] // 8] = True
        moved += 1
        for axis in range(3):
            vertices_out[order[i], axis] = (
                to_world[axis, 0] * x + to_world[axis, 1] * y + to_world[axis, 2] * z + to_world[axis, 3]
            )
    return moved
