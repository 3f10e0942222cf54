"""Triangles of cloth moved out over the vertices of the body that they cover, compiled."""

import math

import numpy as np

from hemline.compiled import kernel

_index = np.uintp
SURELY = np.float32(1.001)
"""Share of the square of the gap from which on a vertex of the body is behind a triangle, whatever the rounding."""


@kernel
def cover_points(starts, points, corners, skin, gap, deepest, sweeps, vertices_out):
    # model: corners (triangles, 3); starts (triangles + 1,): where the points of each begin; points: vertices of the
    #     body that it may cover
    # in: skin (body_verts, 3) [m]; gap: how far behind the triangle a covered vertex is, deepest: from how far in front
    #     of it on it is not covered by it [m]; sweeps   in/out: vertices_out (verts, 3) [m]
    # returns: how often a triangle was moved
    # depth along the unit normal; inside by barycentric weights; corners move by w_i / sum w^2 of what is lacking; a
    # triangle is looked at again only where a corner was moved since
    moved, clock, behind = 0, 0, SURELY * gap * gap
    stirred, seen = np.zeros(len(vertices_out), np.int64), np.full(len(corners), -1, np.int64)
    for _ in range(sweeps):
        before = moved
        for triangle in range(corners.shape[0]):
            t = _index(triangle)
            a, b, c = _index(corners[t, 0]), _index(corners[t, 1]), _index(corners[t, 2])
            if max(stirred[a], stirred[b], stirred[c]) <= seen[t]:
                continue
            seen[t] = clock
            fresh, known = False, False
            for k in range(starts[t], starts[t + _index(1)]):
                if not fresh:
                    x, y, z = vertices_out[a, 0], vertices_out[a, 1], vertices_out[a, 2]
                    ux, uy, uz = vertices_out[b, 0] - x, vertices_out[b, 1] - y, vertices_out[b, 2] - z
                    vx, vy, vz = vertices_out[c, 0] - x, vertices_out[c, 1] - y, vertices_out[c, 2] - z
                    ax, ay, az = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
                    square = ax * ax + ay * ay + az * az
                    fresh, known = True, False
                p = _index(points[_index(k)])
                px, py, pz = skin[p, 0] - x, skin[p, 1] - y, skin[p, 2] - z
                high = px * ax + py * ay + pz * az
                if high < 0 and high * high > behind * square:
                    continue
                if not known:
                    twice = max(math.sqrt(square), 1e-12)
                    nx, ny, nz = ax / twice, ay / twice, az / twice
                    known = True
                lack = px * nx + py * ny + pz * nz + gap
                if lack <= 0 or lack > deepest:
                    continue
                second = ((py * vz - pz * vy) * nx + (pz * vx - px * vz) * ny + (px * vy - py * vx) * nz) / twice
                third = ((uy * pz - uz * py) * nx + (uz * px - ux * pz) * ny + (ux * py - uy * px) * nz) / twice
                first = 1.0 - second - third
                if first < 0 or second < 0 or third < 0:
                    continue
                step = lack / (first * first + second * second + third * third)
                vertices_out[a, 0] += step * first * nx
                vertices_out[a, 1] += step * first * ny
                vertices_out[a, 2] += step * first * nz
                vertices_out[b, 0] += step * second * nx
                vertices_out[b, 1] += step * second * ny
                vertices_out[b, 2] += step * second * nz
                vertices_out[c, 0] += step * third * nx
                vertices_out[c, 1] += step * third * ny
                vertices_out[c, 2] += step * third * nz
                moved += 1
                clock += 1
                stirred[a] = stirred[b] = stirred[c] = clock
                fresh = False
        if moved == before:
            break
    return moved
