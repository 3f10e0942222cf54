"""Vertices of the cloth near capsules that move: compiled code."""

from hemline.compiled import kernel


@kernel
def near_capsules(
    x, home, fixed, then, now, radius, limb, look, vertex_out, normal_out, point_out, radius_out
):  # fmt: skip
    """Which vertices of its limb are within `look` radii of a capsule's axis, and which way it holds them off.

    # in:  x (verts, 3): the cloth at the step's start; home, fixed (verts,): limb, whether it has no contact;
    #      then, now (capsules, 2, 3): ends of the axes at the step's start and end; radius (capsules, 2): at the ends;
    #      limb (capsules,)
    # out: as many as there is room for: vertex, unit normal at the step's end, point of the axis there, radius.
    #      Returns how many there are.
    """
    room, count = vertex_out.shape[0], 0
    for k in range(then.shape[0]):
        a0, a1, a2 = then[k, 0, 0], then[k, 0, 1], then[k, 0, 2]
        d0, d1, d2 = then[k, 1, 0] - a0, then[k, 1, 1] - a1, then[k, 1, 2] - a2
        e0, e1, e2 = now[k, 1, 0] - now[k, 0, 0], now[k, 1, 1] - now[k, 0, 1], now[k, 1, 2] - now[k, 0, 2]
        square = d0 * d0 + d1 * d1 + d2 * d2
        over = 1.0 / (square * (e0 * e0 + e1 * e1 + e2 * e2)) ** 0.5
        # the turn that takes the axis from its first direction to its second: axis times sine, and cosine
        s0, s1, s2 = over * (d1 * e2 - d2 * e1), over * (d2 * e0 - d0 * e2), over * (d0 * e1 - d1 * e0)
        cosine = over * (d0 * e0 + d1 * e1 + d2 * e2)
        widest = look * max(radius[k, 0], radius[k, 1])
        for i in range(x.shape[0]):
            if home[i] != limb[k] or fixed[i]:
                continue
            r0, r1, r2 = x[i, 0] - a0, x[i, 1] - a1, x[i, 2] - a2
            t = min(max((r0 * d0 + r1 * d1 + r2 * d2) / square, 0.0), 1.0)
            r0, r1, r2 = r0 - t * d0, r1 - t * d1, r2 - t * d2
            distance = (r0 * r0 + r1 * r1 + r2 * r2) ** 0.5
            if distance > widest or distance < 1e-9:
                continue
            if distance > look * ((1.0 - t) * radius[k, 0] + t * radius[k, 1]):
                continue
            if count < room:
                n0, n1, n2 = r0 / distance, r1 / distance, r2 / distance
                along = (s0 * n0 + s1 * n1 + s2 * n2) / (1.0 + cosine)
                vertex_out[count] = i
                normal_out[count, 0] = cosine * n0 + s1 * n2 - s2 * n1 + along * s0
                normal_out[count, 1] = cosine * n1 + s2 * n0 - s0 * n2 + along * s1
                normal_out[count, 2] = cosine * n2 + s0 * n1 - s1 * n0 + along * s2
                for c in range(3):
                    point_out[count, c] = (1.0 - t) * now[k, 0, c] + t * now[k, 1, c]
                radius_out[count] = (1.0 - t) * radius[k, 0] + t * radius[k, 1]
            count += 1
    return count
