"""Where a cloth mesh is near itself: vertices near triangles, edges near edges, edges through triangles.

Patches are compared first, by box and by the cone of their normals: a patch, or two that are joined, cannot meet
themselves while all normals agree within 90 degrees (Volino and Magnenat-Thalmann 1994, without their contour test).
"""

import numpy as np

from hemline.compiled import kernel, prange

from .touch_kernels import closest_on_triangle

FAST = {"contract", "nsz", "arcp"}

PARALLEL = 0.97
"""Squared cosine of the angle between two edges from which they are no pair."""


@kernel(parallel=True, fastmath=FAST)
def element_frames(x, faces, edges, corner_starts, corners, face_out, edge_out, vertex_out):
    """Centre, radius and normal of each triangle and edge, (elements, 7), and normals of vertices.

    # out: face_out, edge_out: centre (3), radius, normal (3, not unit); vertex_out: unit normal (3)
    """
    for f in prange(faces.shape[0]):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        radius = 0.0
        for c in range(3):
            face_out[f, c] = (x[i, c] + x[j, c] + x[k, c]) / 3.0
        for corner in range(3):
            v, d = faces[f, corner], 0.0
            for c in range(3):
                d += (x[v, c] - face_out[f, c]) ** 2
            radius = max(radius, d)
        face_out[f, 3] = radius**0.5
        a0, a1, a2 = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]
        b0, b1, b2 = x[k, 0] - x[i, 0], x[k, 1] - x[i, 1], x[k, 2] - x[i, 2]
        face_out[f, 4], face_out[f, 5], face_out[f, 6] = a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0
    for i in prange(x.shape[0]):
        n0 = n1 = n2 = 0.0
        for entry in range(corner_starts[i], corner_starts[i + 1]):
            f = corners[entry] // 3
            n0 += face_out[f, 4]
            n1 += face_out[f, 5]
            n2 += face_out[f, 6]
        over = 1.0 / max((n0 * n0 + n1 * n1 + n2 * n2) ** 0.5, 1e-30)
        vertex_out[i, 0], vertex_out[i, 1], vertex_out[i, 2] = over * n0, over * n1, over * n2
    for e in prange(edges.shape[0]):
        i, j, d = edges[e, 0], edges[e, 1], 0.0
        for c in range(3):
            edge_out[e, c] = 0.5 * (x[i, c] + x[j, c])
            d += (x[i, c] - x[j, c]) ** 2
            edge_out[e, 4 + c] = vertex_out[i, c] + vertex_out[j, c]
        edge_out[e, 3] = 0.5 * d**0.5


@kernel(parallel=True, fastmath=FAST)
def patch_bounds(
    x, moved, faces, edges, face_frames, vertex_starts, vertices, edge_starts, patch_edges, face_starts, patch_faces,
    box_out, motion_out, cone_out,
):  # fmt: skip
    """Box, motion and cone of normals of each patch.

    # out: box (patches, 6): low, high, of all its elements; motion (patches, 4): mean, and the most that a vertex of
    #      one of its elements differs from it; cone (patches, 4): axis, angle
    """
    for p in prange(vertex_starts.shape[0] - 1):
        box, motion, cone = box_out[p], motion_out[p], cone_out[p]
        box[0:3], box[3:6] = 1e30, -1e30
        motion[:], cone[:] = 0.0, 0.0
        first, end = vertex_starts[p], vertex_starts[p + 1]
        for entry in range(first, end):
            i = vertices[entry]
            for c in range(3):
                motion[c] += moved[i, c] / (end - first)
                box[c], box[3 + c] = min(box[c], x[i, c]), max(box[3 + c], x[i, c])
        most = 0.0
        for entry in range(first, end):
            i = vertices[entry]
            most = max(most, _differs(moved, i, motion))
        for entry in range(face_starts[p], face_starts[p + 1]):
            f = patch_faces[entry]
            n0, n1, n2 = face_frames[f, 4], face_frames[f, 5], face_frames[f, 6]
            over = 1.0 / max((n0 * n0 + n1 * n1 + n2 * n2) ** 0.5, 1e-30)
            cone[0] += n0 * over
            cone[1] += n1 * over
            cone[2] += n2 * over
            for corner in range(3):
                i = faces[f, corner]
                most = max(most, _differs(moved, i, motion))
                for c in range(3):
                    box[c], box[3 + c] = min(box[c], x[i, c]), max(box[3 + c], x[i, c])
        for entry in range(edge_starts[p], edge_starts[p + 1]):
            i = edges[patch_edges[entry], 1]
            most = max(most, _differs(moved, i, motion))
            for c in range(3):
                box[c], box[3 + c] = min(box[c], x[i, c]), max(box[3 + c], x[i, c])
        motion[3] = most**0.5
        length = (cone[0] ** 2 + cone[1] ** 2 + cone[2] ** 2) ** 0.5
        widest = 1.0 if length > 1e-12 else -1.0
        for c in range(3):
            cone[c] /= max(length, 1e-12)
        for entry in range(face_starts[p], face_starts[p + 1]):
            f = patch_faces[entry]
            n0, n1, n2 = face_frames[f, 4], face_frames[f, 5], face_frames[f, 6]
            over = 1.0 / max((n0 * n0 + n1 * n1 + n2 * n2) ** 0.5, 1e-30)
            widest = min(widest, over * (n0 * cone[0] + n1 * cone[1] + n2 * cone[2]))
        cone[3] = np.arccos(min(max(widest, -1.0), 1.0))


@kernel(inline="always")
def _differs(moved, i, motion):
    return (moved[i, 0] - motion[0]) ** 2 + (moved[i, 1] - motion[1]) ** 2 + (moved[i, 2] - motion[2]) ** 2


@kernel(parallel=True)
def patch_pairs(box, motion, cone, joined, margin, capacity, count_out, pairs_out):
    """For each patch the patches, itself or later ones, that something of it could meet in the step.

    # in:  capacity: room for each patch in pairs_out (patches, capacity)
    # out: count_out: how many there are, perhaps more than there is room for
    """
    for p in prange(box.shape[0]):
        found = 0
        for q in range(p, box.shape[0]):
            slack = margin + _relative(motion, p, q)
            if (
                box[p, 0] - box[q, 3] > slack or box[q, 0] - box[p, 3] > slack
                or box[p, 1] - box[q, 4] > slack or box[q, 1] - box[p, 4] > slack
                or box[p, 2] - box[q, 5] > slack or box[q, 2] - box[p, 5] > slack
            ):  # fmt: skip
                continue
            if joined[p, q]:
                along = cone[p, 0] * cone[q, 0] + cone[p, 1] * cone[q, 1] + cone[p, 2] * cone[q, 2]
                if np.arccos(min(max(along, -1.0), 1.0)) + cone[p, 3] + cone[q, 3] < 0.5 * np.pi:
                    continue
            if found < capacity:
                pairs_out[p, found] = q
            found += 1
        count_out[p] = found


@kernel(inline="always")
def _relative(motion, p, q):
    """The most that something of one patch moves relative to something of the other."""
    total = 0.0
    for c in range(3):
        total += (motion[p, c] - motion[q, c]) ** 2
    return total**0.5 + (motion[p, 3] + motion[q, 3] if p != q else 2.0 * motion[p, 3])


@kernel
def closest_on_edges(a, b, c, d):
    """Where segments a b and c d are nearest: shares along each, and the squared distance (Ericson 2005, 5.1.9)."""
    u0, u1, u2 = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    v0, v1, v2 = d[0] - c[0], d[1] - c[1], d[2] - c[2]
    r0, r1, r2 = a[0] - c[0], a[1] - c[1], a[2] - c[2]
    uu, vv, uv = u0 * u0 + u1 * u1 + u2 * u2, v0 * v0 + v1 * v1 + v2 * v2, u0 * v0 + u1 * v1 + u2 * v2
    ur, vr = u0 * r0 + u1 * r1 + u2 * r2, v0 * r0 + v1 * r1 + v2 * r2
    steep = uu * vv - uv * uv
    s = min(max((uv * vr - ur * vv) / steep, 0.0), 1.0) if steep > 1e-12 * uu * vv else 0.5
    t = (uv * s + vr) / max(vv, 1e-30)
    if t < 0.0:
        t, s = 0.0, min(max(-ur / max(uu, 1e-30), 0.0), 1.0)
    elif t > 1.0:
        t, s = 1.0, min(max((uv - ur) / max(uu, 1e-30), 0.0), 1.0)
    e0, e1, e2 = r0 + s * u0 - t * v0, r1 + s * u1 - t * v1, r2 + s * u2 - t * v2
    return s, t, e0 * e0 + e1 * e1 + e2 * e2


@kernel(inline="always")
def _far(one, two, slack):
    """Whether two elements, each centre and radius, are farther apart than the slack."""
    reach = one[3] + two[3] + slack
    d0, d1, d2 = one[0] - two[0], one[1] - two[1], one[2] - two[2]
    return d0 * d0 + d1 * d1 + d2 * d2 > reach * reach


@kernel(inline="always")
def _outside(frame, box, slack):
    """Whether an element is farther than the slack from a box."""
    reach = frame[3] + slack
    return (
        frame[0] + reach < box[0] or frame[0] - reach > box[3]
        or frame[1] + reach < box[1] or frame[1] - reach > box[4]
        or frame[2] + reach < box[2] or frame[2] - reach > box[5]
    )  # fmt: skip


@kernel
def _vertex_face(x, moved, i, f, faces, faces_frames, normal, radius, near, slack, margin, room, found, out):
    """Note vertex i and triangle f where they may meet; returns how many were found so far."""
    a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
    if i == a or i == b or i == c:
        return found
    frame = faces_frames[f]
    reach = frame[3] + slack
    d0, d1, d2 = x[i, 0] - frame[0], x[i, 1] - frame[1], x[i, 2] - frame[2]
    if d0 * d0 + d1 * d1 + d2 * d2 > reach * reach:
        return found
    if near and normal[i, 0] * frame[4] + normal[i, 1] * frame[5] + normal[i, 2] * frame[6] > 0.0:
        return found
    v, w, squared = closest_on_triangle(x[i, 0], x[i, 1], x[i, 2], x[a], x[b], x[c])
    u, motion = 1.0 - v - w, 0.0
    for k in range(3):
        motion += (moved[i, k] - u * moved[a, k] - v * moved[b, k] - w * moved[c, k]) ** 2
    thickness = radius[i] + min(radius[a], radius[b], radius[c])
    limit = thickness + margin + motion**0.5
    if squared > limit * limit:
        return found
    if found < room:
        out[found, 0], out[found, 1], out[found, 2], out[found, 3], out[found, 4] = i, a, b, c, 0
    return found + 1


@kernel
def _edge_edge(x, moved, e, g, edges, edge_frames, radius, near, slack, margin, room, found, out):
    """Note edges e and g where they may meet; returns how many were found so far."""
    a, b, c, d = edges[e, 0], edges[e, 1], edges[g, 0], edges[g, 1]
    if a == c or a == d or b == c or b == d:
        return found
    one, two = edge_frames[e], edge_frames[g]
    if _far(one, two, slack) or (near and one[4] * two[4] + one[5] * two[5] + one[6] * two[6] > 0.0):
        return found
    u0, u1, u2 = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
    v0, v1, v2 = x[d, 0] - x[c, 0], x[d, 1] - x[c, 1], x[d, 2] - x[c, 2]
    uv, both = u0 * v0 + u1 * v1 + u2 * v2, (u0 * u0 + u1 * u1 + u2 * u2) * (v0 * v0 + v1 * v1 + v2 * v2)
    # edges that run along each other touch with their ends
    if uv * uv > PARALLEL * both:
        return found
    s, t, squared = closest_on_edges(x[a], x[b], x[c], x[d])
    # ends of edges are met as vertices by triangles
    if (s <= 0.0 or s >= 1.0) and (t <= 0.0 or t >= 1.0):
        return found
    motion = 0.0
    for k in range(3):
        one_moved = moved[a, k] + s * (moved[b, k] - moved[a, k])
        motion += (one_moved - moved[c, k] - t * (moved[d, k] - moved[c, k])) ** 2
    thickness = min(radius[a], radius[b]) + min(radius[c], radius[d])
    limit = thickness + margin + motion**0.5
    if squared > limit * limit:
        return found
    if found < room:
        out[found, 0], out[found, 1], out[found, 2], out[found, 3], out[found, 4] = a, b, c, d, 1
    return found + 1


@kernel(parallel=True)
def near_pairs(
    x, moved, faces, edges, face_frames, edge_frames, normal, radius, box, motion, joined, vertex_starts, vertices,
    edge_starts, patch_edges, face_starts, patch_faces, pairs, thickest, margin, most, chunk, room, count_out, out,
):  # fmt: skip
    """Vertex-triangle and edge-edge pairs of patch pairs that come nearer than thickness and margin in the step.

    # in:  thickest: the largest thickness; most: elements of one kind in a patch, at most;
    #      pairs (patch pairs, 2), worked on in chunks of so many, each with room for so many in out (chunks room, 5)
    # out: count_out: how many each chunk has, perhaps more than there is room for; out: four vertices (first the
    #      vertex, then the triangle; or one edge, then the other), and 1 for edges
    """
    for number in prange(count_out.shape[0]):
        here, found = out[number * room : (number + 1) * room], 0
        some = np.empty(most, np.int32)
        for entry in range(number * chunk, min(pairs.shape[0], (number + 1) * chunk)):
            p, q = pairs[entry, 0], pairs[entry, 1]
            near = joined[p, q] == 1
            slack = thickest + margin + _relative(motion, p, q)
            for turn in range(1 if p == q else 2):
                one, two = (p, q) if turn == 0 else (q, p)
                kept = 0
                for place in range(face_starts[two], face_starts[two + 1]):
                    f = patch_faces[place]
                    if not _outside(face_frames[f], box[one], slack):
                        some[kept] = f
                        kept += 1
                for place in range(vertex_starts[one], vertex_starts[one + 1]):
                    i, outside = vertices[place], False
                    for c in range(3):
                        outside |= x[i, c] + slack < box[two, c] or x[i, c] - slack > box[two, 3 + c]
                    if outside:
                        continue
                    for k in range(kept):
                        found = _vertex_face(
                            x, moved, i, some[k], faces, face_frames, normal, radius, near, slack, margin, room,
                            found, here,
                        )  # fmt: skip
            kept = 0
            for place in range(edge_starts[q], edge_starts[q + 1]):
                g = patch_edges[place]
                if p == q or not _outside(edge_frames[g], box[p], slack):
                    some[kept] = g
                    kept += 1
            for place in range(edge_starts[p], edge_starts[p + 1]):
                e = patch_edges[place]
                if p != q and _outside(edge_frames[e], box[q], slack):
                    continue
                for k in range(kept):
                    if p == q and some[k] <= e:
                        continue
                    found = _edge_edge(
                        x, moved, e, some[k], edges, edge_frames, radius, near, slack, margin, room, found, here
                    )
        count_out[number] = found


@kernel(inline="always")
def _volume(a, b, c, d):
    """Six times the signed volume of a tetrahedron."""
    u0, u1, u2 = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    v0, v1, v2 = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    w0, w1, w2 = d[0] - a[0], d[1] - a[1], d[2] - a[2]
    return (u1 * v2 - u2 * v1) * w0 + (u2 * v0 - u0 * v2) * w1 + (u0 * v1 - u1 * v0) * w2


@kernel
def pierces(p, q, a, b, c):
    """Whether a segment goes through a triangle."""
    if _volume(a, b, c, p) * _volume(a, b, c, q) >= 0.0:
        return False
    one, two, three = _volume(p, q, a, b), _volume(p, q, b, c), _volume(p, q, c, a)
    return (one >= 0.0 and two >= 0.0 and three >= 0.0) or (one <= 0.0 and two <= 0.0 and three <= 0.0)


@kernel(parallel=True)
def piercing_edges(
    x, faces, edges, face_frames, edge_frames, box, joined, edge_starts, patch_edges, face_starts, patch_faces, pairs,
    most, chunk, room, count_out, out,
):  # fmt: skip
    """Edges that go through triangles: out (chunks room, 2) holds edge and triangle."""
    for number in prange(count_out.shape[0]):
        here, found = out[number * room : (number + 1) * room], 0
        some = np.empty(most, np.int32)
        for entry in range(number * chunk, min(pairs.shape[0], (number + 1) * chunk)):
            p, q = pairs[entry, 0], pairs[entry, 1]
            near = joined[p, q] == 1
            for turn in range(1 if p == q else 2):
                one, two = (p, q) if turn == 0 else (q, p)
                kept = 0
                for place in range(face_starts[two], face_starts[two + 1]):
                    if not _outside(face_frames[patch_faces[place]], box[one], 0.0):
                        some[kept] = patch_faces[place]
                        kept += 1
                for place in range(edge_starts[one], edge_starts[one + 1]):
                    e = patch_edges[place]
                    frame = edge_frames[e]
                    if p != q and _outside(frame, box[two], 0.0):
                        continue
                    i, j = edges[e, 0], edges[e, 1]
                    for k in range(kept):
                        f = some[k]
                        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
                        if i == a or i == b or i == c or j == a or j == b or j == c:
                            continue
                        face = face_frames[f]
                        if _far(frame, face, 0.0):
                            continue
                        if near and frame[4] * face[4] + frame[5] * face[5] + frame[6] * face[6] > 0.0:
                            continue
                        if pierces(x[i], x[j], x[a], x[b], x[c]):
                            if found < room:
                                here[found, 0], here[found, 1] = e, f
                            found += 1
        count_out[number] = found


__all__ = [
    "closest_on_edges", "element_frames", "near_pairs", "patch_bounds", "patch_pairs", "piercing_edges", "pierces",
]  # fmt: skip
