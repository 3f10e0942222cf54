"""One frame of a close-fitting garment, compiled."""

from hemline.compiled import kernel


@kernel
def wear(indices, weights, nearest, regions, basis, clearances, mixed, rest, t, skin, normals, most, vertices_out):
    # model: indices, weights (verts, influences); nearest (verts,); regions (verts, regions); basis (verts, 3, modes);
    #     clearances (verts,) [m]
    # in: mixed (regions, modes): what regions make of pose and shape; rest (verts, 3) [m]; t (joints, 3, 4):
    #     skin transforms; skin, normals (body_verts, 3): the body now; most: depth up to which vertices come out [m]
    # out: vertices_out (verts, 3) [m]
    # x = sum_b w_b A_b (rest + sum_g r_g B z_g), then out of the skin along the normal of the vertex under it
    for v in range(indices.shape[0]):
        p0, p1, p2 = rest[v, 0], rest[v, 1], rest[v, 2]
        for g in range(regions.shape[1]):
            share = regions[v, g]
            if share < 1e-4:
                continue
            s0, s1, s2 = p0 * 0, p0 * 0, p0 * 0
            for k in range(basis.shape[2]):
                s0 += basis[v, 0, k] * mixed[g, k]
                s1 += basis[v, 1, k] * mixed[g, k]
                s2 += basis[v, 2, k] * mixed[g, k]
            p0 += share * s0
            p1 += share * s1
            p2 += share * s2
        x, y, z = p0 * 0, p0 * 0, p0 * 0
        for i in range(indices.shape[1]):
            w, b = weights[v, i], indices[v, i]
            if w == 0:
                continue
            x += w * (t[b, 0, 0] * p0 + t[b, 0, 1] * p1 + t[b, 0, 2] * p2 + t[b, 0, 3])
            y += w * (t[b, 1, 0] * p0 + t[b, 1, 1] * p1 + t[b, 1, 2] * p2 + t[b, 1, 3])
            z += w * (t[b, 2, 0] * p0 + t[b, 2, 1] * p1 + t[b, 2, 2] * p2 + t[b, 2, 3])
        n = nearest[v]
        height = (x - skin[n, 0]) * normals[n, 0] + (y - skin[n, 1]) * normals[n, 1] + (z - skin[n, 2]) * normals[n, 2]
        lack = clearances[v] - height
        if 0 < lack < most:
            x += lack * normals[n, 0]
            y += lack * normals[n, 1]
            z += lack * normals[n, 2]
        vertices_out[v, 0], vertices_out[v, 1], vertices_out[v, 2] = x, y, z
