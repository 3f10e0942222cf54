"""One frame of a close-fitting garment, compiled."""

import numpy as np

from hemline.bodies.dual_quaternion_kernels import dual_quaternions
from hemline.compiled import kernel

from .kernel_inputs import GarmentTables

_index = np.uintp
LEAST_REGION_WEIGHT = np.float32(1e-4)
"""Regions with no more weight than this at a vertex are skipped."""
REGIONS_PER_PASS = 3
"""Number of regions summed in one pass; few vertices lie in more."""


@kernel(forceinline=True)
def pack_bones(t, bones_out, opposite_out):
    """Packs each bone in a row of 16: the columns of its transform, each followed by a number of its quaternion.

    Reads: t (joints, 3, 4).
    Writes: bones_out (joints, 16); opposite_out (joints, joints): whether the signs of two quaternions differ.
    """
    duals = np.empty((t.shape[0], 8), np.float32)
    dual_quaternions(t, duals)
    for j in range(t.shape[0]):
        for column in range(4):
            for row in range(3):
                bones_out[j, 4 * column + row] = t[j, row, column]
            bones_out[j, 4 * column + 3] = duals[j, column]
        for i in range(t.shape[0]):
            dot = np.float32(0)
            for q in range(4):
                dot += duals[j, q] * duals[i, q]
            opposite_out[j, i] = dot < 0


@kernel(fastmath={"reassoc", "contract", "nsz"})
def pose_garment(tables: GarmentTables, rest, offset, mixed, t, vertices_out):
    """Poses a garment.

    Model: x = sum_b w_b A_b rest + R (offset + sum_k d_k sum_g r_g m_gk), R of the normalised sum of w_b q_b

    Reads: tables; rest (verts, 3): the garment in the rest pose of the body [m]; offset (verts, 3): mean offsets from
        the skinned garment, in rotated vertex frames [m]; mixed (regions, columns): scaled basis coefficients of each
        region, from pose and shape [m]; t (joints, 3, 4): skin transforms.
    Writes: vertices_out (verts, 3): vertices in the world [m].
    """
    indices, weights, regions, digits = tables
    joints, two = t.shape[0], np.float32(2)
    bones, opposite = np.empty((joints, 16), np.float32), np.empty((joints, joints), np.bool_)
    pack_bones(t, bones, opposite)
    columns, count = digits.shape[2], regions.shape[1]
    active, portions = np.zeros(count + REGIONS_PER_PASS, np.int64), np.zeros(count + REGIONS_PER_PASS, np.float32)
    for vertex in range(indices.shape[0]):
        v = _index(vertex)
        near = 0
        for g in range(count):
            active[near], portions[near] = g, regions[v, _index(g)]
            near += regions[v, _index(g)] > LEAST_REGION_WEIGHT
        for g in range(near, near + REGIONS_PER_PASS):
            portions[g] = 0
        u0, u1, u2 = offset[v, 0], offset[v, 1], offset[v, 2]
        for begin in range(0, near, REGIONS_PER_PASS):
            g = _index(begin)
            one, other, third = portions[g], portions[g + _index(1)], portions[g + _index(2)]
            m, n, o = _index(active[g]), _index(active[g + _index(1)]), _index(active[g + _index(2)])
            for k in range(columns):
                factor = one * mixed[m, k] + other * mixed[n, k] + third * mixed[o, k]
                u0 += np.float32(digits[v, 0, k]) * factor
                u1 += np.float32(digits[v, 1, k]) * factor
                u2 += np.float32(digits[v, 2, k]) * factor
        first = _index(indices[v, 0])
        x0 = x1 = x2 = x3 = y0 = y1 = y2 = y3 = z0 = z1 = z2 = z3 = a = b = c = d = np.float32(0)
        for i in range(indices.shape[1]):
            w, j = weights[v, i], _index(indices[v, i])
            if w == 0:
                break
            s = -w if opposite[first, j] else w
            x0, y0, z0, a = x0 + w * bones[j, 0], y0 + w * bones[j, 1], z0 + w * bones[j, 2], a + s * bones[j, 3]
            x1, y1, z1, b = x1 + w * bones[j, 4], y1 + w * bones[j, 5], z1 + w * bones[j, 6], b + s * bones[j, 7]
            x2, y2, z2, c = x2 + w * bones[j, 8], y2 + w * bones[j, 9], z2 + w * bones[j, 10], c + s * bones[j, 11]
            x3, y3, z3, d = x3 + w * bones[j, 12], y3 + w * bones[j, 13], z3 + w * bones[j, 14], d + s * bones[j, 15]
        p0, p1, p2 = rest[v, 0], rest[v, 1], rest[v, 2]
        x = x0 * p0 + x1 * p1 + x2 * p2 + x3
        y = y0 * p0 + y1 * p1 + y2 * p2 + y3
        z = z0 * p0 + z1 * p1 + z2 * p2 + z3
        scale = np.float32(1) / np.sqrt(a * a + b * b + c * c + d * d)
        a, b, c, d = a * scale, b * scale, c * scale, d * scale
        # a vector u rotated by (a, q): u + 2 a (q x u) + 2 q x (q x u)
        e0, e1, e2 = two * (c * u2 - d * u1), two * (d * u0 - b * u2), two * (b * u1 - c * u0)
        x += u0 + a * e0 + c * e2 - d * e1
        y += u1 + a * e1 + d * e0 - b * e2
        z += u2 + a * e2 + b * e1 - c * e0
        vertices_out[v, 0], vertices_out[v, 1], vertices_out[v, 2] = x, y, z
