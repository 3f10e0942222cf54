"""Bending about the edges of a sheet that is not flat at rest.

Source: Grinspun et al., "Discrete shells", 2003, Eq. 4. Differs: 2 sin(angle / 2) replaces the angle, so that a flat
    rest shape has the energy of the bending matrix of `sheet`; the Hessian is that matrix for all rest angles.
"""

from hemline.compiled import kernel, prange

from .rows import Rows


@kernel(parallel=True)
def hinge_forces(x, hinges, weight, rest, gradient_out, energy_out):
    """Computes energy and gradient of each hinge.

    Model: E = w / 2 (s(angle) - s(rest))^2, s(a) = 2 sin(a / 2); w = bending length^2 / (area + area)
    Reads: x (verts, 3); hinges (hinges, 4): i, j, k, l; weight (hinges,) [N m]; rest (hinges,): s(rest).
    Writes: gradient_out (hinges, 12): at the four vertices [N]; energy_out (hinges,) [J].
    """
    for h in prange(hinges.shape[0]):
        i, j, k, l = hinges[h, 0], hinges[h, 1], hinges[h, 2], hinges[h, 3]
        e0, e1, e2 = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]
        a0, a1, a2 = x[k, 0] - x[i, 0], x[k, 1] - x[i, 1], x[k, 2] - x[i, 2]
        b0, b1, b2 = x[l, 0] - x[i, 0], x[l, 1] - x[i, 1], x[l, 2] - x[i, 2]
        m0, m1, m2 = e1 * a2 - e2 * a1, e2 * a0 - e0 * a2, e0 * a1 - e1 * a0
        n0, n1, n2 = b1 * e2 - b2 * e1, b2 * e0 - b0 * e2, b0 * e1 - b1 * e0
        ee, mm, nn = e0 * e0 + e1 * e1 + e2 * e2, m0 * m0 + m1 * m1 + m2 * m2, n0 * n0 + n1 * n1 + n2 * n2
        if ee * ee < 1e-24 or mm < 1e-24 or nn < 1e-24:
            energy_out[h] = 0.0
            for c in range(12):
                gradient_out[h, c] = 0.0
            continue
        length = ee**0.5
        both = (mm * nn) ** 0.5
        cosine = (m0 * n0 + m1 * n1 + m2 * n2) / both
        sine = ((m1 * n2 - m2 * n1) * e0 + (m2 * n0 - m0 * n2) * e1 + (m0 * n1 - m1 * n0) * e2) / (both * length)
        # 2 sin(a / 2) and its derivative cos(a / 2), with the sign of the sine
        cosine = min(max(cosine, -1.0), 1.0)
        bent = (2.0 * (1.0 - cosine)) ** 0.5
        if sine < 0.0:
            bent = -bent
        half = (0.5 * (1.0 + cosine)) ** 0.5
        off = bent - rest[h]
        energy_out[h] = 0.5 * weight[h] * off * off
        scale = -weight[h] * off * half * length
        k_scale, l_scale = scale / mm, scale / nn
        k_share = (a0 * e0 + a1 * e1 + a2 * e2) / ee
        l_share = (b0 * e0 + b1 * e1 + b2 * e2) / ee
        for c in range(3):
            m = m0 if c == 0 else (m1 if c == 1 else m2)
            n = n0 if c == 0 else (n1 if c == 1 else n2)
            at_k, at_l = k_scale * m, l_scale * n
            gradient_out[h, 6 + c], gradient_out[h, 9 + c] = at_k, at_l
            gradient_out[h, c] = -(1.0 - k_share) * at_k - (1.0 - l_share) * at_l
            gradient_out[h, 3 + c] = -k_share * at_k - l_share * at_l


@kernel(parallel=True)
def hinges_at_vertices(at: Rows, gradient, bent_out):
    """Sums the gradients of the hinges at each vertex.

    Reads: at: hinges of each vertex, 4 hinge + corner; gradient (hinges, 12) [N].
    Writes: bent_out (verts, 3) [N].
    """
    starts, corners = at
    for i in prange(bent_out.shape[0]):
        for c in range(3):
            bent_out[i, c] = 0.0
        for entry in range(starts[i], starts[i + 1]):
            h, corner = corners[entry] // 4, 3 * (corners[entry] % 4)
            for c in range(3):
                bent_out[i, c] += gradient[h, corner + c]


__all__ = ["hinge_forces", "hinges_at_vertices"]
