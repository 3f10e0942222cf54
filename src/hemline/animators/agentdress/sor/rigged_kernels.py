"""Compiled kernels for the offsets that rigged anchors predict in one pose."""

import numpy as np

from hemline.animators.agentdress.kernel_inputs import AnchorTables
from hemline.bodies.dual_quaternion_kernels import dual_quaternions
from hemline.compiled import kernel

_index = np.uintp

WEIGHT_UNIT = np.float32(1 / 255)
"""Size of one quantized step of a skin weight."""

LEAST_BLEND = 1e-4
"""Anchors with less weight at a vertex are skipped there; the remaining weights are normalised."""


@kernel(fastmath={"contract", "nsz"})
def blend_anchors(anchors: AnchorTables, regions, blend, t, carried_out):
    """Blends the garments of the anchors, skinned into a pose.

    Model: x = sum_s w_s sum_b w_sb A_b A_sb^-1 x_s

    Reads: anchors; regions (verts, regions); blend (regions, anchors): weight of each anchor; t (joints, 3, 4): skin
        transforms of the pose.
    Writes: carried_out (verts, 4): weighted sum of the garments [m], and sum of weights.
    """
    earlier, vertices, step, bone_indices, bone_weights = anchors
    carried_out[:] = 0
    m = np.empty(t.shape, np.float32)
    for s in range(vertices.shape[0]):
        if not blend[:, s].any():
            continue
        for j in range(t.shape[0]):
            for row in range(3):
                moved = t[j, row, 3]
                for k in range(3):
                    entry = np.float32(0)
                    for i in range(3):
                        entry += t[j, row, i] * earlier[s, j, k, i]
                    m[j, row, k] = entry
                    moved -= entry * earlier[s, j, k, 3]
                m[j, row, 3] = moved
        for vertex in range(vertices.shape[1]):
            v = _index(vertex)
            weight = np.float32(0)
            for g in range(regions.shape[1]):
                weight += regions[v, g] * blend[g, s]
            if weight < LEAST_BLEND:
                continue
            p0, p1, p2 = step * vertices[s, v, 0], step * vertices[s, v, 1], step * vertices[s, v, 2]
            x, y, z = np.float32(0), np.float32(0), np.float32(0)
            for i in range(bone_indices.shape[2]):
                if bone_weights[s, v, i] == 0:
                    break
                w, j = np.float32(bone_weights[s, v, i]), _index(bone_indices[s, v, i])
                x += w * (m[j, 0, 0] * p0 + m[j, 0, 1] * p1 + m[j, 0, 2] * p2 + m[j, 0, 3])
                y += w * (m[j, 1, 0] * p0 + m[j, 1, 1] * p1 + m[j, 1, 2] * p2 + m[j, 1, 3])
                z += w * (m[j, 2, 0] * p0 + m[j, 2, 1] * p1 + m[j, 2, 2] * p2 + m[j, 2, 3])
            scale = weight * WEIGHT_UNIT
            carried_out[v, 0] += scale * x
            carried_out[v, 1] += scale * y
            carried_out[v, 2] += scale * z
            carried_out[v, 3] += weight


@kernel(fastmath={"contract", "nsz"})
def offsets_from_skinning(indices, weights, rest, t, carried, offset_out):
    """Computes the offsets of a blended garment from the skinned one, in rotated vertex frames.

    Model: offset = R^T (x - sum_b w_b A_b rest), R of the normalised sum of w_b q_b

    Reads: indices, weights (verts, influences), the heaviest bone first; rest (verts, 3) [m]; t (joints, 3, 4): skin
        transforms; carried (verts, 4), of `blend_anchors` [m].
    Writes: offset_out (verts, 3) [m].
    """
    duals = np.empty((t.shape[0], 8), np.float32)
    dual_quaternions(t, duals)
    two = np.float32(2)
    for vertex in range(indices.shape[0]):
        v = _index(vertex)
        whole = np.float32(1) / carried[v, 3]
        u0, u1, u2 = carried[v, 0] * whole, carried[v, 1] * whole, carried[v, 2] * whole
        p0, p1, p2 = rest[v, 0], rest[v, 1], rest[v, 2]
        a, b, c, d = np.float32(0), np.float32(0), np.float32(0), np.float32(0)
        first = _index(indices[v, 0])
        f0, f1, f2, f3 = duals[first, 0], duals[first, 1], duals[first, 2], duals[first, 3]
        for i in range(indices.shape[1]):
            w, j = weights[v, i], _index(indices[v, i])
            if w == 0:
                break
            u0 -= w * (t[j, 0, 0] * p0 + t[j, 0, 1] * p1 + t[j, 0, 2] * p2 + t[j, 0, 3])
            u1 -= w * (t[j, 1, 0] * p0 + t[j, 1, 1] * p1 + t[j, 1, 2] * p2 + t[j, 1, 3])
            u2 -= w * (t[j, 2, 0] * p0 + t[j, 2, 1] * p1 + t[j, 2, 2] * p2 + t[j, 2, 3])
            g0, g1, g2, g3 = duals[j, 0], duals[j, 1], duals[j, 2], duals[j, 3]
            w = -w if f0 * g0 + f1 * g1 + f2 * g2 + f3 * g3 < 0 else w
            a += w * g0
            b += w * g1
            c += w * g2
            d += w * g3
        scale = np.float32(1) / np.sqrt(a * a + b * b + c * c + d * d)
        a, b, c, d = a * scale, -b * scale, -c * scale, -d * scale
        # rotated back, by (a, q): u + 2 a (q x u) + 2 q x (q x u)
        e0, e1, e2 = two * (c * u2 - d * u1), two * (d * u0 - b * u2), two * (b * u1 - c * u0)
        offset_out[v, 0] = u0 + a * e0 + c * e2 - d * e1
        offset_out[v, 1] = u1 + a * e1 + d * e0 - b * e2
        offset_out[v, 2] = u2 + a * e2 + b * e1 - c * e0
