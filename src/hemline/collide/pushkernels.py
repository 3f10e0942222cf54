"""Push garment vertices out of the posed body, in order and smoothly: compiled code."""

import numpy as np

from hemline.compiled import kernel

from .surfacekernels import seek, squared_distance, surface_place, vertex_normal, walk

_index = np.uintp


@kernel(forceinline=True)
def lifted(distance, margin, gap):
    """Distance at which a vertex ends that was at `distance` < `margin`: in (gap, margin), monotone, C1 at the margin."""
    room = margin - gap
    return gap + room * room / (room + margin - distance)


@kernel
def push(
    points,
    ids,
    body,
    ring_start,
    ring,
    known,
    normals,
    anchors,
    offsets,
    decay,
    margin,
    gap,
    reach,
    pushed_out,
    signed_out,
):
    """Where each listed vertex should go to be outside of the surface around its anchor.

    in: points (n,3), ids (k,), body (verts,3), its rings, decay of offsets (0..1), margin, gap, reach [m];
    in and out: anchors (n,), known and normals of the body; offsets (n,3) is only read;
    out: pushed_out (k,3), signed_out (k,): distance before [m], beyond `reach` only roughly.
    """
    place = np.empty(7, np.float32)
    last = np.int64(-1)
    tiny = np.float32(1e-10)
    for k in range(len(ids)):
        i = _index(ids[k])
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        start = np.int64(anchors[i])
        if last >= 0 and squared_distance(body, last, x, y, z) < squared_distance(body, start, x, y, z):
            start = last
        last, squared = walk(body, ring_start, ring, start, x, y, z)
        anchors[i] = last
        ox, oy, oz = offsets[i, 0] * decay, offsets[i, 1] * decay, offsets[i, 2] * decay
        held = ox * ox + oy * oy + oz * oz > tiny
        v = _index(last)
        vertex_normal(body, ring_start, ring, last, known, normals)
        height = (x - body[v, 0]) * normals[v, 0] + (y - body[v, 1]) * normals[v, 1] + (z - body[v, 2]) * normals[v, 2]
        pushed_out[k, 0], pushed_out[k, 1], pushed_out[k, 2] = x, y, z
        signed_out[k] = np.sqrt(squared)
        if height > reach:
            if held:
                pushed_out[k, 0], pushed_out[k, 1], pushed_out[k, 2] = x + ox, y + oy, z + oz
            continue
        surface_place(body, ring_start, ring, last, x, y, z, known, normals, place)
        signed_out[k] = place[6]
        push_from(place, x, y, z, margin, gap, pushed_out[k])
        if held:
            nx, ny, nz = place[3], place[4], place[5]
            done = (pushed_out[k, 0] - x) * nx + (pushed_out[k, 1] - y) * ny + (pushed_out[k, 2] - z) * nz
            more = max(ox * nx + oy * ny + oz * nz - done, np.float32(0))
            pushed_out[k, 0] += more * nx
            pushed_out[k, 1] += more * ny
            pushed_out[k, 2] += more * nz


@kernel
def push_from(place, x, y, z, margin, gap, out):
    """Move a point that is at signed distance < margin from a place of the surface to its lifted distance."""
    distance = place[6]
    out[0], out[1], out[2] = x, y, z
    if distance < margin:
        rise = lifted(distance, margin, gap)
        height = (x - place[0]) * place[3] + (y - place[1]) * place[4] + (z - place[2]) * place[5]
        share = (margin - gap) / (margin - gap + margin - distance)
        for axis in range(3):
            across = (x if axis == 0 else y if axis == 1 else z) - place[axis] - height * place[3 + axis]
            out[axis] = place[axis] + share * across + (rise + share * (height - distance)) * place[3 + axis]


@kernel
def list_tests(points, ids, pushed, per_group, tests_out, group_out, after_out):
    """Positions to test for each listed vertex: where it was, and where it would go if that differs.

    in: points (n,3), ids (k,), pushed (k,3), vertices per group; out: tests_out (2k,3), group_out (2k,), after_out (k,):
    which test is of the pushed position, the one before it being of the other. Returns how many.
    """
    count = 0
    for k in range(len(ids)):
        i = _index(ids[k])
        for twice in range(2):
            moved = pushed[k, 0] != points[i, 0] or pushed[k, 1] != points[i, 1] or pushed[k, 2] != points[i, 2]
            if twice == 0 or moved:
                for axis in range(3):
                    tests_out[count, axis] = points[i, axis] if twice == 0 else pushed[k, axis]
                group_out[count] = ids[k] // per_group
                after_out[k] = count
                count += 1
    return count


@kernel
def judge(signed, winding, after, margin, inside_out, keep_out, bad_out):
    """Decide by the winding numbers of both positions of each vertex.

    in: signed (k,) distances before, winding (tests,), after (k,); out: inside_out (k,): inside before; keep_out (k,):
    free where it was, and pushed by a stale anchor or into something; bad_out: both are inside. Returns how many bad.
    """
    count = 0
    for k in range(len(signed)):
        there = winding[after[k]]
        before = winding[after[k - 1] + 1 if k > 0 else 0]
        inside_out[k] = before != 0
        stale = before == 0 and signed[k] < -margin
        keep_out[k] = before == 0 and abs(signed[k]) > np.float32(1e-5) and (there != 0 or stale)
        if there != 0 and not keep_out[k]:
            bad_out[count] = k
            count += 1
    return count


@kernel
def seek_places(
    points, ids, limb, body, leaf_start, leaf_vertices, patch_start, patch_box, patch_limb, ring_start, ring, known,
    normals, anchors_out, places_out,
):  # fmt: skip
    """Nearest place of the surface to each listed vertex, on the limb named for it (below 0: on any).

    in: points (n,3), ids (k,), limb (k,), the body; out: anchors_out (k,), places_out (k,7).
    """
    bound = np.empty(len(patch_limb), np.float32)
    for k in range(len(ids)):
        x, y, z = points[ids[k], 0], points[ids[k], 1], points[ids[k], 2]
        anchor = seek(
            body, leaf_start, leaf_vertices, patch_start, patch_box, patch_limb, limb[k], x, y, z, bound
        )  # fmt: skip
        anchors_out[k] = anchor
        surface_place(body, ring_start, ring, anchor, x, y, z, known, normals, places_out[k])


@kernel
def settle(points, ids, final, offsets_out, lively_out, frame, order, vertices_out):
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
