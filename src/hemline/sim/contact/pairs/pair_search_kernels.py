"""Search for places where a cloth mesh is near itself: vertices and triangles, edges and edges, edges that cross
triangles.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from hemline.compiled import kernel, prange
from hemline.sim.contact.body.touch_kernels import closest_on_triangle

from .lane_kernels import LANES, NOBODY, SURELY, Lanes, near_lanes
from .patch_kernels import ElementBounds, PatchBounds

INNER_CIRCLE = 0.4
"""Radius of the inner circle of a triangle over its longest edge, rounded up: 0.29 at most."""

SEARCH_MARGIN = 0.001
"""Distance beyond thickness and motion within which pairs are searched for [m]."""

PATCH_PAIR_CHUNK = 64
"""Patch pairs per chunk of the search: fixed, so that the order of results does not depend on the threads."""

PARALLEL_COSINE = 0.97
"""Squared cosine of the angle between two edges from which on they form no pair."""


class ClothMesh(NamedTuple):
    """The mesh that is searched.

    Attributes:
        faces: Triangles.
        edges: Vertex pairs, uint32.
        radius: Half of the thickness at each vertex [m].
        joined: 1 for two patches that are the same, joined by an edge, or both joined to a third one.
    """

    faces: Int[np.ndarray, "faces 3"]
    edges: Int[np.ndarray, "edges 2"]
    radius: Float[np.ndarray, " verts"]
    joined: Int[np.ndarray, "patches patches"]


class Elements(NamedTuple):
    """Vertices, edges and triangles in blocks, see `fill_lanes`."""

    vertices: Lanes
    edges: Lanes
    faces: Lanes


class SearchedCloth(NamedTuple):
    """The positions of a mesh in one step, and the bounds by which it is searched.

    Attributes:
        positions: Positions at the start of the step, float64 [m].
        moved: Motion within the step, float64 [m].
        frames: Bounds of its elements.
        bounds: Bounds of its patches.
        elements: Its elements in blocks.
    """

    positions: Float[np.ndarray, "verts 3"]
    moved: Float[np.ndarray, "verts 3"]
    frames: ElementBounds
    bounds: PatchBounds
    elements: Elements


@kernel(inline="always")
def closest_on_edges(a, b, c, d):
    """Finds the nearest points of the segments a b and c d (Ericson 2005, 5.1.9).

    Reads: a, b, c, d (3,): ends [m].
    Returns: The positions along a b and along c d from 0 to 1, and the squared distance [m^2].
    """
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
def _agree(one, e, two, g):
    """Compares the normals of two elements.

    Reads: one, two (elements, 11): of `ElementBounds`; e, g: numbers of the elements.
    Returns: Whether the normals are within 90 degrees.
    """
    return one[e, 4] * two[g, 4] + one[e, 5] * two[g, 5] + one[e, 6] * two[g, 6] > 0.0


@kernel(inline="always")
def _outside(frame, e, box, motion, p, slack):
    """Compares an element with the box of a patch, both in motion.

    Reads: frame (elements, 11): of `ElementBounds`; e: the element; box (patches, 6), motion (patches, 4): of
        `PatchBounds`; p: the patch; slack [m].
    Returns: Whether the element stays farther than the slack from the box.
    """
    m0, m1, m2 = frame[e, 7] - motion[p, 0], frame[e, 8] - motion[p, 1], frame[e, 9] - motion[p, 2]
    reach = slack + frame[e, 3] + frame[e, 10] + motion[p, 3] + (m0 * m0 + m1 * m1 + m2 * m2) ** 0.5
    return (
        frame[e, 0] + reach < box[p, 0]
        or frame[e, 0] - reach > box[p, 3]
        or frame[e, 1] + reach < box[p, 1]
        or frame[e, 1] - reach > box[p, 4]
        or frame[e, 2] + reach < box[p, 2]
        or frame[e, 2] - reach > box[p, 5]
    )


@kernel(inline="always")
def _vertex_face(x, moved, i, f, mesh: ClothMesh, found, out):
    """Notes a vertex and a triangle that may touch.

    Reads: x, moved (verts, 3): positions and motion [m]; i: the vertex; f: the triangle; mesh; found: results so far.
    Writes: out (room, 5): see `near_pairs`.
    Returns: The number of results, possibly more than there is room for.
    """
    faces, radius = mesh.faces, mesh.radius
    a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
    if i in (a, b, c):
        return found
    v, w, squared = closest_on_triangle(x[i, 0], x[i, 1], x[i, 2], x[a], x[b], x[c])
    u, motion = 1.0 - v - w, 0.0
    for k in range(3):
        motion += (moved[i, k] - u * moved[a, k] - v * moved[b, k] - w * moved[c, k]) ** 2
    thickness = radius[i] + min(radius[a], radius[b], radius[c])
    limit = thickness + SEARCH_MARGIN + motion**0.5
    if squared > limit * limit:
        return found
    if found < out.shape[0]:
        out[found, 0], out[found, 1], out[found, 2], out[found, 3], out[found, 4] = i, a, b, c, 0
    return found + 1


@kernel(inline="always")
def _edge_edge(x, moved, e, g, mesh: ClothMesh, found, out):
    """Notes two edges that may touch.

    Reads: x, moved (verts, 3): positions and motion [m]; e, g: the edges; mesh; found: results so far.
    Writes: out (room, 5): see `near_pairs`.
    Returns: The number of results, possibly more than there is room for; whether one edge could cross a triangle at the
        other, because it is closer than the inner circle of such a triangle reaches.
    """
    edges, radius = mesh.edges, mesh.radius
    a, b, c, d = edges[e, 0], edges[e, 1], edges[g, 0], edges[g, 1]
    if a in (c, d) or b in (c, d):
        return found, False
    u0, u1, u2 = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
    v0, v1, v2 = x[d, 0] - x[c, 0], x[d, 1] - x[c, 1], x[d, 2] - x[c, 2]
    uv, uu, vv = u0 * v0 + u1 * v1 + u2 * v2, u0 * u0 + u1 * u1 + u2 * u2, v0 * v0 + v1 * v1 + v2 * v2
    s, t, squared = closest_on_edges(x[a], x[b], x[c], x[d])
    through = squared < INNER_CIRCLE * INNER_CIRCLE * max(uu, vv)
    # edges that run along each other touch with their ends, and ends are met as vertices by triangles
    if uv * uv > PARALLEL_COSINE * uu * vv or ((s <= 0.0 or s >= 1.0) and (t <= 0.0 or t >= 1.0)):
        return found, through
    motion = 0.0
    for k in range(3):
        one_moved = moved[a, k] + s * (moved[b, k] - moved[a, k])
        motion += (one_moved - moved[c, k] - t * (moved[d, k] - moved[c, k])) ** 2
    thickness = min(radius[a], radius[b]) + min(radius[c], radius[d])
    limit = thickness + SEARCH_MARGIN + motion**0.5
    if squared > limit * limit:
        return found, through
    if found < out.shape[0]:
        out[found, 0], out[found, 1], out[found, 2], out[found, 3], out[found, 4] = a, b, c, d, 1
    return found + 1, through


@kernel(inline="always")
def _near_elements(blocks, block, lane, cosine, apart, others, other):
    """Finds the lanes of another block that the element in a lane may touch.

    Reads: blocks, others (blocks, ROWS, LANES): of `Lanes`; block, lane: the element; cosine: see `near_lanes`; apart:
        added to the element's own reach [m]; other: number of the other block.
    Returns: int32, bit i of which says that lane i may touch.
    """
    centre = blocks[block, 0, lane], blocks[block, 1, lane], blocks[block, 2, lane]
    normal = blocks[block, 4, lane], blocks[block, 5, lane], blocks[block, 6, lane]
    return near_lanes(others, other, centre, np.float32(blocks[block, 3, lane] + apart), normal, cosine)


@kernel(inline="always")
def _drift(motion, p, q):
    """Compares the motions of two patches.

    Reads: motion (patches, 4): of `PatchBounds` [m]; p, q: the patches.
    Returns: The size of their motion relative to each other [m].
    """
    m0, m1, m2 = motion[p, 0] - motion[q, 0], motion[p, 1] - motion[q, 1], motion[p, 2] - motion[q, 2]
    return (m0 * m0 + m1 * m1 + m2 * m2) ** 0.5


@kernel(parallel=True)
def near_pairs(cloth: SearchedCloth, mesh: ClothMesh, pairs, slack, met_out, count_out, out):
    """Finds vertex-triangle and edge-edge pairs that come closer than thickness and `SEARCH_MARGIN` within the step.

    Reads: cloth; mesh; pairs (patch pairs, 2); slack: the largest thickness plus `SEARCH_MARGIN` [m].
    Writes: met_out (patch pairs,): whether an edge may cross a triangle; count_out (chunks,): number of results,
        possibly more than there is room for; out (chunks room, 5): four vertices (the vertex, then the triangle; or one
        edge, then the other), and 1 for edges.
    """
    x, moved, joined = cloth.positions, cloth.moved, mesh.joined
    face_frames, edge_frames, vertex_frames = cloth.frames
    box, motion = cloth.bounds.box, cloth.bounds.motion
    vertex_starts, vertices, vertex_blocks = cloth.elements.vertices
    edge_starts, patch_edges, edge_blocks = cloth.elements.edges
    face_starts, patch_faces, face_blocks = cloth.elements.faces
    room = out.shape[0] // max(count_out.shape[0], 1)
    for number in prange(count_out.shape[0]):
        here, found = out[number * room : (number + 1) * room], 0
        for entry in range(number * PATCH_PAIR_CHUNK, min(pairs.shape[0], (number + 1) * PATCH_PAIR_CHUNK)):
            p, q = pairs[entry, 0], pairs[entry, 1]
            # neighbours whose normals agree do not meet; their boxes always do
            near = joined[p, q] == 1
            cosine, apart = SURELY if near else np.float32(2.0), slack + _drift(motion, p, q)
            met_out[entry] = False
            for turn in range(1 if p == q else 2):
                one, two = (p, q) if turn == 0 else (q, p)
                for block in range(vertex_starts[one], vertex_starts[one + 1]):
                    for lane in range(LANES):
                        i = vertices[block, lane]
                        if i == NOBODY:
                            break
                        if not near and _outside(vertex_frames, i, box, motion, two, slack):
                            continue
                        for other in range(face_starts[two], face_starts[two + 1]):
                            some = _near_elements(vertex_blocks, block, lane, cosine, apart, face_blocks, other)
                            if some == 0:
                                continue
                            for k in range(LANES):
                                f = patch_faces[other, k]
                                if some >> k & 1 and not (near and _agree(vertex_frames, i, face_frames, f)):
                                    found = _vertex_face(x, moved, i, f, mesh, found, here)
            for block in range(edge_starts[p], edge_starts[p + 1]):
                for lane in range(LANES):
                    e = patch_edges[block, lane]
                    if e == NOBODY:
                        break
                    if not near and _outside(edge_frames, e, box, motion, q, slack):
                        continue
                    for other in range(block if p == q else edge_starts[q], edge_starts[q + 1]):
                        some = _near_elements(edge_blocks, block, lane, cosine, apart, edge_blocks, other)
                        if some == 0:
                            continue
                        for k in range(LANES):
                            g = patch_edges[other, k]
                            if (
                                some >> k & 1
                                and not (p == q and g <= e)
                                and not (near and _agree(edge_frames, e, edge_frames, g))
                            ):
                                found, through = _edge_edge(x, moved, e, g, mesh, found, here)
                                met_out[entry] |= through
        count_out[number] = found


@kernel(inline="always")
def _volume(a, b, c, d):
    """Computes six times the signed volume of a tetrahedron.

    Reads: a, b, c, d (3,): corners [m].
    Returns: The volume [m^3].
    """
    u0, u1, u2 = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    v0, v1, v2 = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    w0, w1, w2 = d[0] - a[0], d[1] - a[1], d[2] - a[2]
    return (u1 * v2 - u2 * v1) * w0 + (u2 * v0 - u0 * v2) * w1 + (u0 * v1 - u1 * v0) * w2


@kernel(inline="always")
def pierces(p, q, a, b, c):
    """Tells whether a segment crosses a triangle; independent of the count of crossings that checks the result.

    Reads: p, q (3,): ends of the segment [m]; a, b, c (3,): corners of the triangle [m].
    Returns: Whether they cross.
    """
    if _volume(a, b, c, p) * _volume(a, b, c, q) >= 0.0:
        return False
    one, two, three = _volume(p, q, a, b), _volume(p, q, b, c), _volume(p, q, c, a)
    return (one >= 0.0 and two >= 0.0 and three >= 0.0) or (one <= 0.0 and two <= 0.0 and three <= 0.0)


@kernel(parallel=True)
def piercing_edges(cloth: SearchedCloth, mesh: ClothMesh, pairs, count_out, out):
    """Finds edges that cross triangles.

    Reads: cloth; mesh; pairs (patch pairs, 2).
    Writes: count_out (chunks,): number of results, possibly more than there is room for; out (chunks room, 2): edge,
        triangle.
    """
    x, (faces, edges, _, joined) = cloth.positions, mesh
    face_frames, edge_frames = cloth.frames.faces, cloth.frames.edges
    box, motion = cloth.bounds.box, cloth.bounds.motion
    edge_starts, patch_edges, edge_blocks = cloth.elements.edges
    face_starts, patch_faces, face_blocks = cloth.elements.faces
    room = out.shape[0] // max(count_out.shape[0], 1)
    for number in prange(count_out.shape[0]):
        here, found = out[number * room : (number + 1) * room], 0
        for entry in range(number * PATCH_PAIR_CHUNK, min(pairs.shape[0], (number + 1) * PATCH_PAIR_CHUNK)):
            p, q = pairs[entry, 0], pairs[entry, 1]
            near = joined[p, q] == 1
            cosine, apart = SURELY if near else np.float32(2.0), _drift(motion, p, q)
            for turn in range(1 if p == q else 2):
                one, two = (p, q) if turn == 0 else (q, p)
                for block in range(edge_starts[one], edge_starts[one + 1]):
                    for lane in range(LANES):
                        e = patch_edges[block, lane]
                        if e == NOBODY:
                            break
                        if not near and not _touches(edge_frames, e, box, two):
                            continue
                        i, j = edges[e, 0], edges[e, 1]
                        for other in range(face_starts[two], face_starts[two + 1]):
                            some = _near_elements(edge_blocks, block, lane, cosine, apart, face_blocks, other)
                            if some == 0:
                                continue
                            for k in range(LANES):
                                f = patch_faces[other, k]
                                if not some >> k & 1 or (near and _agree(edge_frames, e, face_frames, f)):
                                    continue
                                a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
                                if i in (a, b, c) or j in (a, b, c):
                                    continue
                                if pierces(x[i], x[j], x[a], x[b], x[c]):
                                    if found < room:
                                        here[found, 0], here[found, 1] = e, f
                                    found += 1
        count_out[number] = found


@kernel(inline="always")
def _touches(frame, e, box, p):
    """Compares the sphere about an element with the box of a patch.

    Reads: frame (elements, 11): of `ElementBounds`; e: the element; box (patches, 6): of `PatchBounds` [m]; p: the
        patch.
    Returns: Whether they touch.
    """
    reach = frame[e, 3]
    return (
        frame[e, 0] + reach >= box[p, 0]
        and frame[e, 0] - reach <= box[p, 3]
        and frame[e, 1] + reach >= box[p, 1]
        and frame[e, 1] - reach <= box[p, 4]
        and frame[e, 2] + reach >= box[p, 2]
        and frame[e, 2] - reach <= box[p, 5]
    )


__all__ = [
    "PATCH_PAIR_CHUNK",
    "SEARCH_MARGIN",
    "ClothMesh",
    "Elements",
    "SearchedCloth",
    "closest_on_edges",
    "near_pairs",
    "pierces",
    "piercing_edges",
]
