"""One frame of a close-fitting garment, compiled."""

import numpy as np

from hemline.bodies.dual_quaternion_kernels import dual_quaternions
from hemline.compiled import kernel

_index = np.uintp
NEVER = np.float32(-1)
"""A clearance that no vertex lacks [m]."""


@kernel(fastmath={"reassoc", "contract", "nsz"})
def wear(indices, weights, nearest, regions, digits, clearances, mixed, rest, offset, normals, t, skin, lengths, out):
    # model: indices, weights (verts, influences), the heaviest bone first; nearest (verts,): vertices of the body;
    #     regions (verts, regions); digits int8 (verts, 3, columns); clearances (verts,) [m]
    # in: mixed (regions, columns): what regions make of pose and shape, with the scale of the column [m];
    #     rest, offset (verts, 3) [m]; normals (verts, 3) of the body under it, in its rest pose;
    #     t (joints, 3, 4): skin transforms; skin (body_verts, 3): the body now [m];
    #     lengths: depth up to which vertices come out, and how far beside the vertex of the body they may be [m]
    # out: out (verts, 3): vertices in the world [m]
    # x = sum_b w_b A_b rest + R (offset + sum_k d_k sum_g r_g m_gk), R of the normalised sum of w_b q_b;
    # then out of the skin along R n
    duals = np.empty((t.shape[0], 8), np.float32)
    dual_quaternions(t, duals)
    columns, two = digits.shape[2], np.float32(2)
    shares = np.empty(columns, np.float32)
    for vertex in range(indices.shape[0]):
        v = _index(vertex)
        for k in range(columns):
            shares[k] = 0
        for g in range(regions.shape[1]):
            share = regions[v, g]
            if share > 1e-4:
                for k in range(columns):
                    shares[k] += share * mixed[g, k]
        u0, u1, u2 = offset[v, 0], offset[v, 1], offset[v, 2]
        for k in range(columns):
            share = shares[k]
            u0 += np.float32(digits[v, 0, k]) * share
            u1 += np.float32(digits[v, 1, k]) * share
            u2 += np.float32(digits[v, 2, k]) * share
        p0, p1, p2 = rest[v, 0], rest[v, 1], rest[v, 2]
        x, y, z = np.float32(0), np.float32(0), np.float32(0)
        a, b, c, d = np.float32(0), np.float32(0), np.float32(0), np.float32(0)
        first = _index(indices[v, 0])
        f0, f1, f2, f3 = duals[first, 0], duals[first, 1], duals[first, 2], duals[first, 3]
        for i in range(indices.shape[1]):
            w, j = weights[v, i], _index(indices[v, i])
            if w == 0:
                break
            x += w * (t[j, 0, 0] * p0 + t[j, 0, 1] * p1 + t[j, 0, 2] * p2 + t[j, 0, 3])
            y += w * (t[j, 1, 0] * p0 + t[j, 1, 1] * p1 + t[j, 1, 2] * p2 + t[j, 1, 3])
            z += w * (t[j, 2, 0] * p0 + t[j, 2, 1] * p1 + t[j, 2, 2] * p2 + t[j, 2, 3])
            g0, g1, g2, g3 = duals[j, 0], duals[j, 1], duals[j, 2], duals[j, 3]
            w = -w if f0 * g0 + f1 * g1 + f2 * g2 + f3 * g3 < 0 else w
            a += w * g0
            b += w * g1
            c += w * g2
            d += w * g3
        scale = np.float32(1) / np.sqrt(a * a + b * b + c * c + d * d)
        a, b, c, d = a * scale, b * scale, c * scale, d * scale
        # a vector u turned by (a, q): u + 2 a (q x u) + 2 q x (q x u)
        e0, e1, e2 = two * (c * u2 - d * u1), two * (d * u0 - b * u2), two * (b * u1 - c * u0)
        x += u0 + a * e0 + c * e2 - d * e1
        y += u1 + a * e1 + d * e0 - b * e2
        z += u2 + a * e2 + b * e1 - c * e0
        if clearances[v] <= NEVER:
            out[v, 0], out[v, 1], out[v, 2] = x, y, z
            continue
        n = _index(nearest[v])
        p0, p1, p2 = x - skin[n, 0], y - skin[n, 1], z - skin[n, 2]
        u0, u1, u2 = normals[v, 0], normals[v, 1], normals[v, 2]
        e0, e1, e2 = two * (c * u2 - d * u1), two * (d * u0 - b * u2), two * (b * u1 - c * u0)
        u0, u1, u2 = u0 + a * e0 + c * e2 - d * e1, u1 + a * e1 + d * e0 - b * e2, u2 + a * e2 + b * e1 - c * e0
        height = p0 * u0 + p1 * u1 + p2 * u2
        lack = clearances[v] - height
        if 0 < lack < lengths[0] and p0 * p0 + p1 * p1 + p2 * p2 - height * height < lengths[1] * lengths[1]:
            x, y, z = x + lack * u0, y + lack * u1, z + lack * u2
        out[v, 0], out[v, 1], out[v, 2] = x, y, z
