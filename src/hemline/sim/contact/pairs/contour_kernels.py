"""Untangling of crossed cloth: the direction that shortens the curve along which the cloth crosses itself.

Source: Volino, Magnenat-Thalmann, "Resolving surface collisions through intersection contour minimization", 2006, Eq.
    7.
"""

from hemline.compiled import kernel, prange


@kernel(parallel=True)
def contour_directions(x, edges, faces, opposite, piercing, direction_out, share_out, weights_out):
    """Computes for each edge that crosses a triangle the unit direction in which to move the edge against the triangle.

    Model: G = sum over the edge's triangles of R - 2 (E . R) / (E . N) N, with E the edge, N the triangle's normal, R
        the direction of the curve from the edge into the edge's triangle
    Reads: piercing (n, 2): edge, triangle; opposite (edges, 2): third vertices of the edge's triangles.
    Writes: direction_out (n, 3): 0 where the curve is straight; share_out (n,): position along the edge; weights_out
        (n, 2): weights of corners 1 and 2.
    """
    for k in prange(piercing.shape[0]):
        e, f = piercing[k, 0], piercing[k, 1]
        i, j = edges[e, 0], edges[e, 1]
        a, b, c = x[faces[f, 0]], x[faces[f, 1]], x[faces[f, 2]]
        u0, u1, u2 = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        v0, v1, v2 = c[0] - a[0], c[1] - a[1], c[2] - a[2]
        n0, n1, n2 = u1 * v2 - u2 * v1, u2 * v0 - u0 * v2, u0 * v1 - u1 * v0
        double = (n0 * n0 + n1 * n1 + n2 * n2) ** 0.5
        e0, e1, e2 = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]
        length = (e0 * e0 + e1 * e1 + e2 * e2) ** 0.5
        direction_out[k, 0] = direction_out[k, 1] = direction_out[k, 2] = 0.0
        share_out[k], weights_out[k, 0], weights_out[k, 1] = 0.5, 1.0 / 3.0, 1.0 / 3.0
        if double < 1e-14 or length < 1e-9:
            continue
        n0, n1, n2 = n0 / double, n1 / double, n2 / double
        e0, e1, e2 = e0 / length, e1 / length, e2 / length
        steep = e0 * n0 + e1 * n1 + e2 * n2
        s0, s1, s2 = a[0] - x[i, 0], a[1] - x[i, 1], a[2] - x[i, 2]
        if abs(steep) < 1e-6:
            continue
        along = (s0 * n0 + s1 * n1 + s2 * n2) / steep
        share_out[k] = min(max(along / length, 0.0), 1.0)
        p0, p1, p2 = along * e0 - s0, along * e1 - s1, along * e2 - s2
        v = ((p1 * v2 - p2 * v1) * n0 + (p2 * v0 - p0 * v2) * n1 + (p0 * v1 - p1 * v0) * n2) / double
        w = ((u1 * p2 - u2 * p1) * n0 + (u2 * p0 - u0 * p2) * n1 + (u0 * p1 - u1 * p0) * n2) / double
        weights_out[k, 0], weights_out[k, 1] = v, w
        g0 = g1 = g2 = 0.0
        for side in range(2):
            o = opposite[e, side]
            if o == i:
                continue
            o0, o1, o2 = x[o, 0] - x[i, 0], x[o, 1] - x[i, 1], x[o, 2] - x[i, 2]
            m0, m1, m2 = e1 * o2 - e2 * o1, e2 * o0 - e0 * o2, e0 * o1 - e1 * o0
            r0, r1, r2 = n1 * m2 - n2 * m1, n2 * m0 - n0 * m2, n0 * m1 - n1 * m0
            size = (r0 * r0 + r1 * r1 + r2 * r2) ** 0.5
            if size < 1e-14:
                continue
            # into the edge's triangle
            back = o0 * e0 + o1 * e1 + o2 * e2
            inward = r0 * (o0 - back * e0) + r1 * (o1 - back * e1) + r2 * (o2 - back * e2)
            over = (1.0 if inward > 0.0 else -1.0) / size
            r0, r1, r2 = over * r0, over * r1, over * r2
            turn = 2.0 * (e0 * r0 + e1 * r1 + e2 * r2) / steep
            g0 += r0 - turn * n0
            g1 += r1 - turn * n1
            g2 += r2 - turn * n2
        size = (g0 * g0 + g1 * g1 + g2 * g2) ** 0.5
        if size > 1e-6:
            direction_out[k, 0], direction_out[k, 1], direction_out[k, 2] = g0 / size, g1 / size, g2 / size


__all__ = ["contour_directions"]
