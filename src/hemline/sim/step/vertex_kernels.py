"""The fused kernel of inertia, air and contact with the body, which act on each vertex alone; the Hessian's diagonal.

The energy of each term is in a file of its own (`inertia_kernels`, `air_kernels`, `load_kernels`) and called here. The
terms share one pass over the vertices for speed, and because their energies are summed vertex by vertex: any other
order would change the last bits of the result.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from hemline.compiled import kernel, prange
from hemline.sim.cloth.air_kernels import Air, air_terms
from hemline.sim.cloth.elastic_kernels import FAST, VERTEX_CHUNK
from hemline.sim.cloth.inertia_kernels import Inertia, inertia_terms
from hemline.sim.contact.body.load_kernels import SkinContact, contact_terms, slip_terms
from hemline.sim.solver.conjugate_kernels import Matrix
from hemline.sim.solver.layout import Pattern


class PotentialEvaluation(NamedTuple):
    """What a potential is at some positions.

    Attributes:
        gradient: Gradient of all terms [N].
        energy: Energy of inertia, air and contact with the body, by chunk of vertices [J].
        residual: Sum of the size of the gradient over free vertices, by chunk of vertices [N].
    """

    gradient: Float[np.ndarray, "verts 3"]
    energy: Float[np.ndarray, " chunks"]
    residual: Float[np.ndarray, " chunks"]


@kernel(parallel=True, fastmath=FAST)
def gradient(x, pressed, inertia: Inertia, air: Air, contact: SkinContact, fixed, out: PotentialEvaluation):
    """Computes the gradient at each vertex and, by chunk, the energy and the sum of |gradient| over free vertices.

    Reads: x (verts, 3) [m]; pressed (verts, 3): gradient of all other terms, whose energies are not included here [N];
        inertia; air; contact; fixed (verts,) bool.
    Writes: out.
    """
    gradient_out, energy_out, residual_out = out.gradient, out.energy, out.residual
    goal, inertial_stiffness = inertia
    start, air_force, air_matrix = air
    normal, point, carried, stiffness, limit, thickness, depth, creep = contact
    count = x.shape[0]
    for chunk in prange((count + VERTEX_CHUNK - 1) // VERTEX_CHUNK):
        energy, residual = 0.0, 0.0
        for i in range(chunk * VERTEX_CHUNK, min(count, (chunk + 1) * VERTEX_CHUNK)):
            x0, x1, x2 = x[i, 0], x[i, 1], x[i, 2]
            value, i0, i1, i2 = inertia_terms(inertial_stiffness[i], x0 - goal[i, 0], x1 - goal[i, 1], x2 - goal[i, 2])
            energy += value
            g0, g1, g2 = i0 + pressed[i, 0], i1 + pressed[i, 1], i2 + pressed[i, 2]
            value, a0, a1, a2 = air_terms(
                air_matrix[i], air_force[i], x0 - start[i, 0], x1 - start[i, 1], x2 - start[i, 2]
            )
            energy += value
            g0 += a0
            g1 += a1
            g2 += a2
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
    x, inertia: Inertia, air: Air, contact: SkinContact, fixed, pair_diagonal, pattern: Pattern, matrix_out: Matrix
):
    """Computes the diagonal blocks of the Hessian, and their inverses, which are 0 for fixed vertices; flat, nine per
    slot.

    Reads: x (verts, 3) [m]; inertia; contact; fixed (verts,) bool; pattern; air: its matrix includes the blocks of
        additional terms; pair_diagonal (verts, 6): blocks of pairs, which are only part of the inverse, since the
        solver applies pairs separately; matrix_out.blocks: the entries of the ring.
    Writes: matrix_out.diagonal, matrix_out.inverse.
    """
    _, inertial_stiffness = inertia
    _, _, air_matrix = air
    normal, point, carried, stiffness, limit, thickness, depth, creep = contact
    slot, _, _, _, _, ring_starts, _, far_starts, _, far_bending = pattern
    blocks, diagonal_out, inverse_out = matrix_out
    for i in prange(x.shape[0]):
        m, row = air_matrix[i], slot[i]
        a = inertial_stiffness[i]
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
def count_farther(x, y, distance):
    """Counts the points that are farther than a distance from their partners.

    Reads: x, y (points, 3) [m]; distance [m].
    Returns: The number of points.
    """
    count = 0
    for i in prange(x.shape[0]):
        d0, d1, d2 = x[i, 0] - y[i, 0], x[i, 1] - y[i, 1], x[i, 2] - y[i, 2]
        count += d0 * d0 + d1 * d1 + d2 * d2 > distance * distance
    return count


@kernel(parallel=True)
def write_right_side(gradient, slot, right_out):
    """Writes minus the gradient as a vector of the solver.

    Reads: gradient (verts, 3) [N]; slot (verts,): slot of each vertex.
    Writes: right_out: four numbers per slot [N].
    """
    for i in prange(gradient.shape[0]):
        for axis in range(3):
            right_out[4 * slot[i] + axis] = -gradient[i, axis]


@kernel(parallel=True)
def step_along(x, fraction, solution, slot, out):
    """Moves along the solution of the solver: out = x + fraction * solution.

    Reads: x (verts, 3) [m]; fraction; solution: a vector of the solver, by slots [m]; slot (verts,): slot of each
        vertex.
    Writes: out (verts, 3) [m].
    """
    for i in prange(x.shape[0]):
        for axis in range(3):
            out[i, axis] = x[i, axis] + fraction * solution[4 * slot[i] + axis]


__all__ = [
    "PotentialEvaluation",
    "count_farther",
    "diagonal_blocks",
    "gradient",
    "step_along",
    "write_right_side",
]
