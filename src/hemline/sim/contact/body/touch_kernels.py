"""Closest points of cloth vertices on a moving triangle mesh, and the contact planes there."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from hemline.compiled import kernel, prange

from .planes import Planes, SkinPoints

SEARCH_BLOCK = 32
"""Vertices in one block of the search."""

BLOCK_STRIDE = 97
"""Number of blocks from one to the next that the same thread searches; a prime."""


class SearchGrid(NamedTuple):
    """Points sorted into cubic cells: cell c holds order[starts[c]:starts[c + 1]].

    Attributes:
        low: Corner of the grid [m].
        cell: Size of a cell [m].
        size: Number of cells along each axis.
        starts: First entry of each cell.
        order: Numbers of the points, cell by cell.
    """

    low: Float[np.ndarray, "3"]
    cell: float
    size: Int[np.ndarray, "3"]
    starts: Int[np.ndarray, " cells_and_two"]
    order: Int[np.ndarray, " points"]


class SkinMesh(NamedTuple):
    """The body's mesh at one moment.

    Attributes:
        vertices: Positions [m].
        normals: Unit normals at the vertices.
        faces: Triangles.
        star_starts, star: Triangles around each vertex.
    """

    vertices: Float[np.ndarray, "verts 3"]
    normals: Float[np.ndarray, "verts 3"]
    faces: Int[np.ndarray, "faces 3"]
    star_starts: Int[np.ndarray, " verts_and_one"]
    star: Int[np.ndarray, " corners"]


@kernel
def fill_grid(points, low, cell, size, starts_out, order_out):
    """Sorts points into the cubic cells of a `SearchGrid`. Points off the grid are left out.

    Reads: points (points, 3) [m]; low (3,): corner of the grid [m]; cell: size of a cell [m]; size (3,): cells along
        each axis.
    Writes: starts_out (cells + 2,); order_out (points,).
    """
    count = points.shape[0]
    starts_out[:] = 0
    for i in range(count):
        c = cell_of(points, i, low, cell, size)
        if c >= 0:
            starts_out[c + 2] += 1
    for c in range(2, starts_out.shape[0]):
        starts_out[c] += starts_out[c - 1]
    for i in range(count):
        c = cell_of(points, i, low, cell, size)
        if c >= 0:
            order_out[starts_out[c + 1]] = i
            starts_out[c + 1] += 1


@kernel(inline="always")
def cell_of(points, i, low, cell, size):
    """Finds the cell of a point.

    Reads: points (points, 3) [m]; i: number of the point; low, cell, size: see `fill_grid`.
    Returns: The number of the cell, -1 off the grid.
    """
    a, b, c = (points[i, 0] - low[0]) / cell, (points[i, 1] - low[1]) / cell, (points[i, 2] - low[2]) / cell
    if a < 0 or b < 0 or c < 0 or a >= size[0] or b >= size[1] or c >= size[2]:
        return -1
    return (int(a) * size[1] + int(b)) * size[2] + int(c)


@kernel(inline="always")
def cells_between(first, last, low, cell, count):
    """Finds the cells of a span along an axis.

    Reads: first, last: the span [m]; low: lowest coordinate of the grid [m]; cell: size of a cell [m]; count: cells.
    Returns: The first and the last cell; the last is before the first if the span is off the grid.
    """
    return int(max((first - low) / cell, 0.0)), int(min((last - low) / cell, count - 1.0))


@kernel(inline="always")
def closest_on_triangle(px, py, pz, a, b, c):
    """Finds the point of triangle a b c that is closest to p (Ericson 2005).

    Reads: px, py, pz: the point p [m]; a, b, c (3,): corners [m].
    Returns: The weights of b and c, and the squared distance [m^2].
    """
    abx, aby, abz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    acx, acy, acz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    apx, apy, apz = px - a[0], py - a[1], pz - a[2]
    d1, d2 = abx * apx + aby * apy + abz * apz, acx * apx + acy * apy + acz * apz
    aa, bb, ab = abx * abx + aby * aby + abz * abz, acx * acx + acy * acy + acz * acz, abx * acx + aby * acy + abz * acz
    d3, d4, d5, d6 = d1 - aa, d2 - ab, d1 - ab, d2 - bb
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    if d1 <= 0.0 and d2 <= 0.0:
        v, w = 0.0, 0.0
    elif d3 >= 0.0 and d4 <= d3:
        v, w = 1.0, 0.0
    elif d6 >= 0.0 and d5 <= d6:
        v, w = 0.0, 1.0
    elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        v, w = d1 / (d1 - d3), 0.0
    elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        v, w = 0.0, d2 / (d2 - d6)
    elif va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        v = 1.0 - w
    else:
        over = 1.0 / (va + vb + vc)
        v, w = vb * over, vc * over
    x, y, z = apx - v * abx - w * acx, apy - v * aby - w * acy, apz - v * abz - w * acz
    return v, w, x * x + y * y + z * z


@kernel(inline="always")
def closest_around(px, py, pz, vertex, skin: SkinMesh):
    """Finds the face closest to p among those around a vertex and around the corners that it leads to.

    Reads: px, py, pz: the point p [m]; vertex: vertex of the body; skin.
    Returns: The face, and the weights of its corners 1 and 2.
    """
    vertices, faces, star_starts, star = skin.vertices, skin.faces, skin.star_starts, skin.star
    best, face, bv, bw = 1e30, -1, 0.0, 0.0
    centre = last = vertex
    for visit in range(4):
        improved = False
        for entry in range(star_starts[centre], star_starts[centre + 1]):
            f = star[entry]
            if visit > 0 and (faces[f, 0] == last or faces[f, 1] == last or faces[f, 2] == last):
                continue
            v, w, d = closest_on_triangle(
                px, py, pz, vertices[faces[f, 0]], vertices[faces[f, 1]], vertices[faces[f, 2]]
            )
            if d < best:
                best, face, bv, bw, improved = d, f, v, w, True
        if not improved or face < 0:
            break
        # go on around the corner that the closest point is nearest to
        corner = 0
        if bv > 1.0 - bv - bw and bv >= bw:
            corner = 1
        elif bw > 1.0 - bv - bw and bw > bv:
            corner = 2
        if faces[face, corner] == centre:
            break
        last, centre = centre, faces[face, corner]
    return face, bv, bw


@kernel(parallel=True)
def closest_faces(x, skin: SkinMesh, grid: SearchGrid, reach, selected, out: SkinPoints):
    """Finds for each selected cloth vertex the closest face within reach and the weights of its corners; -1 for none.

    Reads: x (verts, 3) float64 [m]; skin; grid: of the skin's vertices; reach [m]; selected (verts,) bool; out.nearest:
        the last nearest body vertices, which bound the search and do not change its result.
    Writes: out; values of vertices that are not selected stay.
    """
    vertices = skin.vertices
    low, cell, size, cell_starts, order = grid
    nearest_out, face_out, weights_out = out.nearest, out.face, out.weights
    # garments lie near the body at one end of their numbering: blocks are dealt out so that each thread gets both ends
    count, blocks = x.shape[0], (x.shape[0] + SEARCH_BLOCK - 1) // SEARCH_BLOCK
    blocks += blocks % BLOCK_STRIDE == 0
    for turn in prange(blocks):
        first = turn * BLOCK_STRIDE % blocks * SEARCH_BLOCK
        for i in range(first, min(first + SEARCH_BLOCK, count)):
            if not selected[i]:
                continue
            face_out[i] = -1
            px, py, pz = x[i, 0], x[i, 1], x[i, 2]
            best, found = reach * reach, -1
            known = nearest_out[i]
            if known >= 0:
                d0, d1, d2 = vertices[known, 0] - px, vertices[known, 1] - py, vertices[known, 2] - pz
                d = d0 * d0 + d1 * d1 + d2 * d2
                if d <= best:
                    best, found = d, known
            radius = best**0.5
            a0, a1 = cells_between(px - radius, px + radius, low[0], cell, size[0])
            b0, b1 = cells_between(py - radius, py + radius, low[1], cell, size[1])
            c0, c1 = cells_between(pz - radius, pz + radius, low[2], cell, size[2])
            if c0 > c1:
                # off the grid along its rows, whose ends would be read beyond them
                a1 = a0 - 1
            for a in range(a0, a1 + 1):
                for b in range(b0, b1 + 1):
                    row = (a * size[1] + b) * size[2]
                    for entry in range(cell_starts[row + c0], cell_starts[row + c1 + 1]):
                        j = order[entry]
                        d0, d1, d2 = vertices[j, 0] - px, vertices[j, 1] - py, vertices[j, 2] - pz
                        d = d0 * d0 + d1 * d1 + d2 * d2
                        if d < best or (d == best and j < found):
                            best, found = d, j
            nearest_out[i] = found
            if found < 0:
                continue
            face, bv, bw = closest_around(px, py, pz, found, skin)
            face_out[i], weights_out[i, 0], weights_out[i, 1] = face, bv, bw


@kernel(parallel=True)
def contact_planes(start, closest: SkinPoints, vertices_then, now: SkinMesh, stiffness, out: Planes):
    """Computes the plane of the body under each vertex at the end of the step, and where the body carries the vertex.

    Reads: start (verts, 3): the cloth at the start [m]; closest: places on the body; vertices_then (body verts, 3): the
        body at the start [m]; now: the body at the end; stiffness (verts,) [N/m].
    Writes: out: interpolated unit normal, point on the body, where that point carries the vertex, and stiffness; all 0
        without contact.
    """
    _, face, weights = closest
    vertices_now, normals_now, faces, _, _ = now
    normal_out, point_out, carried_out, stiffness_out = out.normal, out.point, out.carried, out.stiffness
    for i in prange(start.shape[0]):
        f = face[i]
        stiffness_out[i] = 0.0
        if f < 0:
            for k in range(3):
                normal_out[i, k] = point_out[i, k] = carried_out[i, k] = 0.0
            continue
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        v, w = weights[i, 0], weights[i, 1]
        u = 1.0 - v - w
        length = 0.0
        for k in range(3):
            now = u * vertices_now[a, k] + v * vertices_now[b, k] + w * vertices_now[c, k]
            then = u * vertices_then[a, k] + v * vertices_then[b, k] + w * vertices_then[c, k]
            n = u * normals_now[a, k] + v * normals_now[b, k] + w * normals_now[c, k]
            point_out[i, k] = now
            carried_out[i, k] = start[i, k] + (now - then)
            normal_out[i, k] = n
            length += n * n
        if length > 1e-12:
            stiffness_out[i] = stiffness[i]
            over = 1.0 / length**0.5
            for k in range(3):
                normal_out[i, k] *= over


@kernel(parallel=True)
def mark_strays(x, fixed, distance, searched_at, selected_out):
    """Marks the free vertices that are farther than a distance from where their face was searched for.

    Reads: x, searched_at (verts, 3) [m]; fixed (verts,) bool; distance [m].
    Writes: selected_out (verts,) bool; searched_at: x of the marked vertices.
    Returns: The number of marked vertices.
    """
    count = 0
    for i in prange(x.shape[0]):
        d0, d1, d2 = x[i, 0] - searched_at[i, 0], x[i, 1] - searched_at[i, 1], x[i, 2] - searched_at[i, 2]
        selected_out[i] = not fixed[i] and d0 * d0 + d1 * d1 + d2 * d2 > distance * distance
        if selected_out[i]:
            searched_at[i, 0], searched_at[i, 1], searched_at[i, 2] = x[i, 0], x[i, 1], x[i, 2]
            count += 1
    return count


@kernel(parallel=True)
def mark_turned_inside(x, old_normal, old_stiffness, normal, point, stiffness, turned_out):
    """Marks vertices behind their new plane whose old plane faced the other way.

    Reads: x, point (verts, 3) [m]; old_normal, normal (verts, 3): unit normals of the planes; old_stiffness, stiffness
        (verts,) [N/m].
    Writes: turned_out (verts,) bool.
    """
    for i in prange(x.shape[0]):
        across = gap = 0.0
        for k in range(3):
            across += old_normal[i, k] * normal[i, k]
            gap += normal[i, k] * (x[i, k] - point[i, k])
        turned_out[i] = old_stiffness[i] > 0.0 and stiffness[i] > 0.0 and gap < 0.0 and across < 0.0


__all__ = [
    "SearchGrid",
    "SkinMesh",
    "cell_of",
    "cells_between",
    "closest_around",
    "closest_faces",
    "closest_on_triangle",
    "contact_planes",
    "fill_grid",
    "mark_strays",
    "mark_turned_inside",
]
