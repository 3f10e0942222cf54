"""What gathers at a vertex: the gradient and the energy of one step's potential, and the diagonal of its Hessian.

The potential of one step of length h (backward Euler), whose minimum is the new position:

    pull / 2 |x - y|^2 + membrane + bending + air + contact + friction

- pull: m / h^2 and the spring of a soft pin together; y is then the mean of both goals, each with its share;
- bending: -1/4 sum q_ij |x_i - x_j|^2 with q the off-diagonal entries, or what `bent` brings in its place;
- air: -f . x + 1/2 (x - x_0) . D (x - x_0), D a symmetric 3 x 3 matrix a vertex;
- contact: gap g = n . (x - p) - thickness; where g < 0: k/2 g^2, beyond `depth` linear;
- friction: Coulomb's cone with lagged load, smooth below a slip: limit * f0(|u|), u the slip along the surface.
"""

from hemline.compiled import kernel, prange
from hemline.sim.contact.load_kernels import contact_terms, slip_terms

CHUNK = 128
"""Vertices in one partial sum: fixed, so that sums do not depend on the number of threads."""

FAST = {"contract", "nsz", "arcp"}


@kernel(parallel=True, fastmath=FAST)
def elastic_at_vertices(
    x,
    corner_starts,
    corners,
    corner,
    ring_starts,
    ring,
    ring_bending,
    far_starts,
    far,
    far_bending,
    bent,
    elastic_out,
    energy_out,
):
    """Gradient of membrane and bending at each vertex, and by chunk the energy of `ring_bending` and `far_bending`."""
    count = x.shape[0]
    for chunk in prange((count + CHUNK - 1) // CHUNK):
        energy = 0.0
        for i in range(chunk * CHUNK, min(count, (chunk + 1) * CHUNK)):
            x0, x1, x2 = x[i, 0], x[i, 1], x[i, 2]
            g0, g1, g2 = bent[i, 0], bent[i, 1], bent[i, 2]
            for entry in range(corner_starts[i], corner_starts[i + 1]):
                at = corners[entry]
                f, c = at // 3, 3 * (at % 3)
                g0 += corner[f, c]
                g1 += corner[f, c + 1]
                g2 += corner[f, c + 2]
            for entry in range(ring_starts[i], ring_starts[i + 1]):
                j, q = ring[entry], ring_bending[entry]
                e0, e1, e2 = x[j, 0] - x0, x[j, 1] - x1, x[j, 2] - x2
                g0 += q * e0
                g1 += q * e1
                g2 += q * e2
                energy -= 0.25 * q * (e0 * e0 + e1 * e1 + e2 * e2)
            for entry in range(far_starts[i], far_starts[i + 1]):
                j, q = far[entry], far_bending[entry]
                e0, e1, e2 = x[j, 0] - x0, x[j, 1] - x1, x[j, 2] - x2
                g0 += q * e0
                g1 += q * e1
                g2 += q * e2
                energy -= 0.25 * q * (e0 * e0 + e1 * e1 + e2 * e2)
            elastic_out[i, 0], elastic_out[i, 1], elastic_out[i, 2] = g0, g1, g2
        energy_out[chunk] = energy


@kernel(parallel=True, fastmath=FAST)
def gradient(
    x,
    inertial,
    pull,
    pressed,
    start,
    air,
    air_matrix,
    normal,
    point,
    carried,
    stiffness,
    limit,
    thickness,
    depth,
    creep,
    fixed,
    gradient_out,
    energy_out,
    residual_out,
):
    """Gradient at each vertex, and by chunk: energy, and the sum of |gradient| over free vertices.

    # in: pressed: what membrane, bending and pairs bring; their energies are not in here
    """
    count = x.shape[0]
    for chunk in prange((count + CHUNK - 1) // CHUNK):
        energy, residual = 0.0, 0.0
        for i in range(chunk * CHUNK, min(count, (chunk + 1) * CHUNK)):
            x0, x1, x2 = x[i, 0], x[i, 1], x[i, 2]
            d0, d1, d2 = x0 - inertial[i, 0], x1 - inertial[i, 1], x2 - inertial[i, 2]
            k = pull[i]
            energy += 0.5 * k * (d0 * d0 + d1 * d1 + d2 * d2)
            g0, g1, g2 = k * d0 + pressed[i, 0], k * d1 + pressed[i, 1], k * d2 + pressed[i, 2]
            s0, s1, s2 = x0 - start[i, 0], x1 - start[i, 1], x2 - start[i, 2]
            m = air_matrix[i]
            a0 = m[0] * s0 + m[1] * s1 + m[2] * s2
            a1 = m[1] * s0 + m[3] * s1 + m[4] * s2
            a2 = m[2] * s0 + m[4] * s1 + m[5] * s2
            energy += 0.5 * (a0 * s0 + a1 * s1 + a2 * s2) - air[i, 0] * s0 - air[i, 1] * s1 - air[i, 2] * s2
            g0 += a0 - air[i, 0]
            g1 += a1 - air[i, 1]
            g2 += a2 - air[i, 2]
            if stiffness[i] > 0.0:
                n0, n1, n2 = normal[i, 0], normal[i, 1], normal[i, 2]
                gap = n0 * (x0 - point[i, 0]) + n1 * (x1 - point[i, 1]) + n2 * (x2 - point[i, 2]) - thickness
                value, load, _ = contact_terms(gap, stiffness[i], depth)
                energy += value
                g0 -= load * n0
                g1 -= load * n1
                g2 -= load * n2
                if limit[i] > 0.0:
                    u0, u1, u2 = x0 - carried[i, 0], x1 - carried[i, 1], x2 - carried[i, 2]
                    along = u0 * n0 + u1 * n1 + u2 * n2
                    u0, u1, u2 = u0 - along * n0, u1 - along * n1, u2 - along * n2
                    value, over = slip_terms((u0 * u0 + u1 * u1 + u2 * u2) ** 0.5, creep)
                    energy += limit[i] * value
                    g0 += limit[i] * over * u0
                    g1 += limit[i] * over * u1
                    g2 += limit[i] * over * u2
            gradient_out[i, 0], gradient_out[i, 1], gradient_out[i, 2] = g0, g1, g2
            if not fixed[i]:
                residual += (g0 * g0 + g1 * g1 + g2 * g2) ** 0.5
        energy_out[chunk], residual_out[chunk] = energy, residual


@kernel(parallel=True, fastmath=FAST)
def diagonal_blocks(
    x,
    pull,
    slot,
    ring_starts,
    blocks,
    far_starts,
    far_bending,
    air_matrix,
    pair_diagonal,
    normal,
    point,
    carried,
    stiffness,
    limit,
    thickness,
    depth,
    creep,
    fixed,
    diagonal_out,
    inverse_out,
):
    """Diagonal blocks of the Hessian, and their inverses, which are 0 for fixed vertices; flat, nine a slot.

    # in:  slot: place of each vertex in the solver's order, in which rows and blocks are; pair_diagonal: what pairs of
    #      the cloth with itself bring; the solver applies them apart from the blocks, so it is in the inverse only
    """
    for i in prange(x.shape[0]):
        m, row = air_matrix[i], slot[i]
        a = pull[i]
        for entry in range(far_starts[row], far_starts[row + 1]):
            a -= far_bending[entry]
        xx, xy, xz, yy, yz, zz = a + m[0], m[1], m[2], a + m[3], m[4], a + m[5]
        for entry in range(ring_starts[row], ring_starts[row + 1]):
            b = blocks[9 * entry : 9 * entry + 9]
            xx -= b[0]
            xy -= 0.5 * (b[1] + b[3])
            xz -= 0.5 * (b[2] + b[6])
            yy -= b[4]
            yz -= 0.5 * (b[5] + b[7])
            zz -= b[8]
        if stiffness[i] > 0.0:
            n0, n1, n2 = normal[i, 0], normal[i, 1], normal[i, 2]
            gap = n0 * (x[i, 0] - point[i, 0]) + n1 * (x[i, 1] - point[i, 1]) + n2 * (x[i, 2] - point[i, 2]) - thickness
            _, _, k = contact_terms(gap, stiffness[i], depth)
            t = 0.0
            if limit[i] > 0.0:
                u0, u1, u2 = x[i, 0] - carried[i, 0], x[i, 1] - carried[i, 1], x[i, 2] - carried[i, 2]
                along = u0 * n0 + u1 * n1 + u2 * n2
                u0, u1, u2 = u0 - along * n0, u1 - along * n1, u2 - along * n2
                _, over = slip_terms((u0 * u0 + u1 * u1 + u2 * u2) ** 0.5, creep)
                t = limit[i] * over
            # k n n^T + t (I - n n^T)
            xx += t + (k - t) * n0 * n0
            xy += (k - t) * n0 * n1
            xz += (k - t) * n0 * n2
            yy += t + (k - t) * n1 * n1
            yz += (k - t) * n1 * n2
            zz += t + (k - t) * n2 * n2
        d = diagonal_out[9 * row : 9 * row + 9]
        d[0], d[1], d[2], d[3], d[4], d[5], d[6], d[7], d[8] = xx, xy, xz, xy, yy, yz, xz, yz, zz
        m = pair_diagonal[i]
        xx, xy, xz, yy, yz, zz = xx + m[0], xy + m[1], xz + m[2], yy + m[3], yz + m[4], zz + m[5]
        c0, c1, c2 = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
        over = 0.0 if fixed[i] else 1.0 / (xx * c0 + xy * c1 + xz * c2)
        a0, a1, a2 = c0 * over, c1 * over, c2 * over
        a4, a5, a8 = (xx * zz - xz * xz) * over, (xy * xz - xx * yz) * over, (xx * yy - xy * xy) * over
        d = inverse_out[9 * row : 9 * row + 9]
        d[0], d[1], d[2], d[3], d[4], d[5], d[6], d[7], d[8] = a0, a1, a2, a1, a4, a5, a2, a5, a8


@kernel(parallel=True)
def farther_than(x, y, distance):
    """How many points of x are farther than a distance from those of y."""
    count = 0
    for i in prange(x.shape[0]):
        d0, d1, d2 = x[i, 0] - y[i, 0], x[i, 1] - y[i, 1], x[i, 2] - y[i, 2]
        count += d0 * d0 + d1 * d1 + d2 * d2 > distance * distance
    return count


@kernel(parallel=True)
def opposed(gradient, slot, right_out):
    """Minus the gradient as a vector of the solver: four numbers a slot."""
    for i in prange(gradient.shape[0]):
        for axis in range(3):
            right_out[4 * slot[i] + axis] = -gradient[i, axis]


@kernel(parallel=True)
def moved(x, share, solution, slot, out):
    """out = x + share solution, the solution being a vector of the solver."""
    for i in prange(x.shape[0]):
        for axis in range(3):
            out[i, axis] = x[i, axis] + share * solution[4 * slot[i] + axis]


__all__ = [
    "CHUNK",
    "diagonal_blocks",
    "elastic_at_vertices",
    "farther_than",
    "gradient",
    "moved",
    "opposed",
]
