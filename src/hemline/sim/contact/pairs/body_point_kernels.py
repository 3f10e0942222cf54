"""Search for vertices of the body that are about to go through a triangle of the cloth."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from hemline.compiled import kernel, prange
from hemline.sim.contact.body.planes import Planes, SkinPoints
from hemline.sim.contact.body.touch_kernels import (
    BLOCK_STRIDE,
    SearchGrid,
    SkinMesh,
    cells_between,
    closest_on_triangle,
)

MAX_POINT_DEPTH = 0.005
"""Maximum depth by which a body vertex may stand out of the cloth at the start of a step and still count [m]."""

POINT_STIFFNESS, MAX_STIFFNESS_RATIO = 32.0, 4.0
"""Stiffness of a point at a depth of one thickness: relative to a cloth vertex with the area around the body vertex,
and its maximum relative to the vertices of the triangle.
"""

TRIANGLE_CHUNK = 256
"""Triangles per chunk of the search: fixed, so that the order of results does not depend on the threads."""

CIRCLE_RATIO = 0.58
"""Radius of the circle around a triangle over its longest edge, rounded up, where that circle is the smallest one."""


class GuessedCloth(NamedTuple):
    """The cloth in a step, as it goes on without new contact.

    Attributes:
        guess: Predicted positions at the end of the step [m].
        start: Positions at the start of the step [m].
        faces: Triangles.
        fixed: Vertices without contact.
        piece: Piece of cloth of each vertex.
        stiffness: Contact stiffness [N/m].
        friction: Coulomb's coefficient on the body.
        area: Area around each vertex [m^2].
    """

    guess: Float[np.ndarray, "verts 3"]
    start: Float[np.ndarray, "verts 3"]
    faces: Int[np.ndarray, "faces 3"]
    fixed: Bool[np.ndarray, " verts"]
    piece: Int[np.ndarray, " verts"]
    stiffness: Float[np.ndarray, " verts"]
    friction: Float[np.ndarray, " verts"]
    area: Float[np.ndarray, " verts"]


class SlidCloth(NamedTuple):
    """Working memory of the search.

    Attributes:
        positions: The cloth as it slides along the body at its initial height, because the prediction of the height
            changes with every contact [m].
        distances: Distance from the body, and motion towards it [m].
    """

    positions: Float[np.ndarray, "verts 3"]
    distances: Float[np.ndarray, "verts 2"]


class PointContacts(NamedTuple):
    """Result of a search, chunk by chunk; all chunks have the same room.

    Attributes:
        count: Number of results of each chunk, possibly more than there is room for.
        entries: Vertex of the body, triangle of the cloth.
        weights: Weights of the triangle's corners 1 and 2, and the squared distance [m^2].
    """

    count: Int[np.ndarray, " chunks"]
    entries: Int[np.ndarray, "room 2"]
    weights: Float[np.ndarray, "room 3"]


class PointRows(NamedTuple):
    """Points of the cloth above vertices of the body.

    Attributes:
        body_vertex: The body vertex under each point.
        corners: Triangle of each point; its last corner stands twice.
        weights: Weights of the corners, the last of them 0.
        start: The point at the start of the step [m].
        ahead: Predicted point at the end of the step [m].
        stiffness: Contact stiffness [N/m].
        friction: Coulomb's coefficient.
    """

    body_vertex: Int[np.ndarray, " points"]
    corners: Int[np.ndarray, "points 4"]
    weights: Float[np.ndarray, "points 4"]
    start: Float[np.ndarray, "points 3"]
    ahead: Float[np.ndarray, "points 3"]
    stiffness: Float[np.ndarray, " points"]
    friction: Float[np.ndarray, " points"]


@kernel(parallel=True)
def points_above(
    cloth: GuessedCloth,
    ahead: SkinPoints,
    planes: Planes,
    skin: SkinMesh,
    grid: SearchGrid,
    slack,
    slid_out: SlidCloth,
    out: PointContacts,
):
    """Finds vertices of the body that are, or nearly are, on the wrong side of a triangle of the cloth.

    A body vertex counts if the triangle is not higher above it along its normal than `slack`, and not farther away than
    `MAX_POINT_DEPTH`, both plus the motion towards the body, and not farther away than a cell of the grid. The number
    of chunks is not a multiple of BLOCK_STRIDE: chunks are dealt out so that each thread gets triangles near the body.

    Reads: cloth; ahead: closest points on the body at the end of the step; planes: normals there, where the body would
        carry each vertex, and stiffness, 0 for vertices that are not over the body; skin, grid: the body at the end of
        the step; slack [m].
    Writes: slid_out; out.
    """
    x, faces, fixed, reach = cloth.guess, cloth.faces, cloth.fixed, grid.cell
    ahead_face, ahead_weights = ahead.face, ahead.weights
    carried, out_of_body, stiffness = planes.carried, planes.normal, planes.stiffness
    vertices, body_faces = skin.vertices, skin.faces
    slid, far, count_out = slid_out.positions, slid_out.distances, out.count
    for i in prange(x.shape[0]):
        g, v, w = ahead_face[i], ahead_weights[i, 0], ahead_weights[i, 1]
        away, along = reach * reach if g < 0 else 0.0, 0.0
        for k in range(3):
            if stiffness[i] > 0.0:
                along += out_of_body[i, k] * (x[i, k] - carried[i, k])
            if g >= 0:
                on = (1.0 - v - w) * vertices[body_faces[g, 0], k]
                on += v * vertices[body_faces[g, 1], k] + w * vertices[body_faces[g, 2], k]
                away += (x[i, k] - on) ** 2
        for k in range(3):
            slid[i, k] = x[i, k] - along * out_of_body[i, k]
        far[i, 0], far[i, 1] = away**0.5 - max(along, 0.0), max(-along, 0.0)
    chunks = count_out.shape[0]
    for turn in prange(chunks):
        number = turn * BLOCK_STRIDE % chunks
        count_out[number] = 0
        for f in range(number * TRIANGLE_CHUNK, min(faces.shape[0], (number + 1) * TRIANGLE_CHUNK)):
            a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
            if fixed[a] or fixed[b] or fixed[c]:
                continue
            if not (stiffness[a] > 0.0 or stiffness[b] > 0.0 or stiffness[c] > 0.0):
                continue
            longest = 0.0
            for corner in range(3):
                i, j, side = faces[f, corner], faces[f, (corner + 1) % 3], 0.0
                for k in range(3):
                    side += (slid[i, k] - slid[j, k]) ** 2
                longest = max(longest, side)
            longest = longest**0.5
            nearest = min(far[a, 0], far[b, 0], far[c, 0])
            farthest = max(far[a, 0], far[b, 0], far[c, 0])
            towards = max(far[a, 1], far[b, 1], far[c, 1])
            limit = min(MAX_POINT_DEPTH + towards, reach)
            # no point of the triangle is nearer to the body than this
            if max(farthest - longest, nearest - CIRCLE_RATIO * longest) > limit:
                continue
            _note_vertices((slid[a], slid[b], slid[c]), f, skin, grid, slack + towards, limit, number, out)


@kernel
def _note_vertices(triangle, f, skin: SkinMesh, grid: SearchGrid, slack, limit, number, out: PointContacts):
    """Notes the vertices of the body near a triangle of the cloth.

    Reads: triangle: its three corners [m]; f: its number; skin; grid; slack: height up to which a vertex counts [m];
        limit: distance up to which it counts [m]; number: chunk of the triangle.
    Writes: out: the results of that chunk.
    """
    p, q, r = triangle
    vertices, normals, order, starts = skin.vertices, skin.normals, grid.order, grid.starts
    low, cell, size = grid.low, grid.cell, grid.size
    entries_out, weights_out, found = out.entries, out.weights, out.count[number]
    room = entries_out.shape[0] // out.count.shape[0]
    first = number * room
    a0, a1 = cells_between(min(p[0], q[0], r[0]) - limit, max(p[0], q[0], r[0]) + limit, low[0], cell, size[0])
    b0, b1 = cells_between(min(p[1], q[1], r[1]) - limit, max(p[1], q[1], r[1]) + limit, low[1], cell, size[1])
    c0, c1 = cells_between(min(p[2], q[2], r[2]) - limit, max(p[2], q[2], r[2]) + limit, low[2], cell, size[2])
    if c0 > c1:
        # off the grid along its rows, whose ends would be read beyond them
        return
    u0, u1, u2 = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    v0, v1, v2 = r[0] - p[0], r[1] - p[1], r[2] - p[2]
    n0, n1, n2 = u1 * v2 - u2 * v1, u2 * v0 - u0 * v2, u0 * v1 - u1 * v0
    double = (n0 * n0 + n1 * n1 + n2 * n2) ** 0.5
    thick, highest = limit * double, slack * double * double
    m0, m1, m2 = (p[0] + q[0] + r[0]) / 3.0, (p[1] + q[1] + r[1]) / 3.0, (p[2] + q[2] + r[2]) / 3.0
    around = 0.0
    for corner in (p, q, r):
        around = max(around, (corner[0] - m0) ** 2 + (corner[1] - m1) ** 2 + (corner[2] - m2) ** 2)
    around = (around**0.5 + limit) ** 2
    for a in range(a0, a1 + 1):
        for b in range(b0, b1 + 1):
            row = (a * size[1] + b) * size[2]
            for entry in range(starts[row + c0], starts[row + c1 + 1]):
                j = order[entry]
                d0, d1, d2 = vertices[j, 0] - m0, vertices[j, 1] - m1, vertices[j, 2] - m2
                above = n0 * d0 + n1 * d1 + n2 * d2
                if d0 * d0 + d1 * d1 + d2 * d2 > around or abs(above) > thick:
                    continue
                # how high the triangle's plane is over the vertex: its inside, if that is where the closest point is
                if -above * (n0 * normals[j, 0] + n1 * normals[j, 1] + n2 * normals[j, 2]) > highest:
                    continue
                v, w, squared = closest_on_triangle(vertices[j, 0], vertices[j, 1], vertices[j, 2], p, q, r)
                # a corner is a vertex of the cloth, which has a contact of its own
                if squared > limit * limit or max(v, w, 1.0 - v - w) >= 1.0:
                    continue
                if found < room:
                    entries_out[first + found, 0], entries_out[first + found, 1] = j, f
                    weights_out[first + found, 0], weights_out[first + found, 1] = v, w
                    weights_out[first + found, 2] = squared
                found += 1
    out.count[number] = found


@kernel
def nearest_points(
    candidates: PointContacts, cloth: GuessedCloth, pieces, then: SkinMesh, vertices_now, out: PointRows
):
    """Selects for each body vertex the nearest triangle of each piece of cloth, and gathers the cloth's values there.

    Pieces that are worn over each other touch the same finger. A vertex more than `MAX_POINT_DEPTH` above the cloth at
    the start of the step lies behind the cloth on this side of a finger and belongs to the far side.

    Reads: candidates: from `points_above`; cloth; pieces: number of pieces of cloth; then: the body at the start of the
        step; vertices_now (body verts, 3): the body at its end [m].
    Writes: out: the points.
    Returns: The number of points.
    """
    count, entries, found_weights = candidates
    guess, start, faces, _, piece, vertex_stiffness, friction, area = cloth
    vertices_then, normals_then, room = then.vertices, then.normals, entries.shape[0] // count.shape[0]
    body_vertex_out, corners_out, weights_out, start_out, ahead_out, stiffness_out, friction_out = out
    best = np.full(vertices_then.shape[0] * pieces, -1, np.int32)
    for chunk in range(count.shape[0]):
        for entry in range(chunk * room, chunk * room + count[chunk]):
            kind = entries[entry, 0] * pieces + piece[faces[entries[entry, 1], 0]]
            if best[kind] < 0 or found_weights[entry, 2] < found_weights[best[kind], 2]:
                best[kind] = entry
    rows = 0
    for chunk in range(count.shape[0]):
        for entry in range(chunk * room, chunk * room + count[chunk]):
            j, f = entries[entry, 0], entries[entry, 1]
            if best[j * pieces + piece[faces[f, 0]]] != entry:
                continue
            a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
            v, w = found_weights[entry, 0], found_weights[entry, 1]
            u, height = 1.0 - v - w, 0.0
            for k in range(3):
                start_out[rows, k] = u * start[a, k] + v * start[b, k] + w * start[c, k]
                ahead_out[rows, k] = u * guess[a, k] + v * guess[b, k] + w * guess[c, k]
                height += normals_then[j, k] * (start_out[rows, k] - vertices_then[j, k])
            if height <= -MAX_POINT_DEPTH:
                continue
            body_vertex_out[rows] = j
            corners_out[rows, 0], corners_out[rows, 1], corners_out[rows, 2], corners_out[rows, 3] = a, b, c, c
            weights_out[rows, 0], weights_out[rows, 1], weights_out[rows, 2], weights_out[rows, 3] = u, v, w, 0.0
            around = _area_around(j, vertices_now, then)
            factor = min(POINT_STIFFNESS * around / (u * area[a] + v * area[b] + w * area[c]), MAX_STIFFNESS_RATIO)
            stiffness_out[rows] = factor * (u * vertex_stiffness[a] + v * vertex_stiffness[b] + w * vertex_stiffness[c])
            friction_out[rows] = u * friction[a] + v * friction[b] + w * friction[c]
            rows += 1
    return rows


@kernel
def _area_around(j, vertices, skin: SkinMesh):
    """Computes a third of the area of the triangles around a vertex of the body.

    Reads: j: the vertex; vertices (body verts, 3) [m]; skin: triangles of the body, and those around each vertex.
    Returns: The area [m^2].
    """
    total, faces, starts = 0.0, skin.faces, skin.star_starts
    for entry in range(starts[j], starts[j + 1]):
        f = skin.star[entry]
        p, q, r = vertices[faces[f, 0]], vertices[faces[f, 1]], vertices[faces[f, 2]]
        u0, u1, u2 = q[0] - p[0], q[1] - p[1], q[2] - p[2]
        v0, v1, v2 = r[0] - p[0], r[1] - p[1], r[2] - p[2]
        n0, n1, n2 = u1 * v2 - u2 * v1, u2 * v0 - u0 * v2, u0 * v1 - u1 * v0
        total += (n0 * n0 + n1 * n1 + n2 * n2) ** 0.5 / 6.0
    return total


@kernel
def points_on(x, corners, weights, out):
    """Computes points of triangles from the weights of their corners.

    Reads: x (verts, 3) [m]; corners, weights (points, 4): of which the first three count.
    Writes: out (points, 3) [m].
    """
    for p in range(corners.shape[0]):
        for k in range(3):
            out[p, k] = 0.0
            for c in range(3):
                out[p, k] += weights[p, c] * x[corners[p, c], k]


__all__ = ["GuessedCloth", "PointContacts", "PointRows", "SlidCloth", "nearest_points", "points_above", "points_on"]
