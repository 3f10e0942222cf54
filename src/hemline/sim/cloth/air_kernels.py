"""Drag and lift of triangles in the wind."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from hemline.compiled import kernel, prange

from .rows import Rows


class Air(NamedTuple):
    """Force of the air on each vertex as a function of its displacement s within the step: force - matrix s.

    Attributes:
        start: Reference positions of the displacements [m].
        force: Force at displacement 0 [N].
        matrix: Symmetric matrix as xx, xy, xz, yy, yz, zz [N/m].
    """

    start: Float[np.ndarray, "verts 3"]
    force: Float[np.ndarray, "verts 3"]
    matrix: Float[np.ndarray, "verts 6"]


class TriangleAir(NamedTuple):
    """A third of the air on each triangle.

    Attributes:
        force: Force at the given velocity [N].
        matrix: D = -dF/dv, symmetric, as xx, xy, xz, yy, yz, zz [N s/m].
    """

    force: Float[np.ndarray, "faces 3"]
    matrix: Float[np.ndarray, "faces 6"]


@kernel(inline="always")
def air_terms(m, f, s0, s1, s2):
    """Computes the energy s . m s / 2 - f . s of a vertex that has moved by s.

    Reads: m (6,) [N/m] and f (3,) [N]: of `Air`; s0, s1, s2: the displacement [m].
    Returns: The energy [J], and the three coordinates of its gradient [N].
    """
    a0 = m[0] * s0 + m[1] * s1 + m[2] * s2
    a1 = m[1] * s0 + m[3] * s1 + m[4] * s2
    a2 = m[2] * s0 + m[4] * s1 + m[5] * s2
    value = 0.5 * (a0 * s0 + a1 * s1 + a2 * s2) - f[0] * s0 - f[1] * s1 - f[2] * s2
    return value, a0 - f[0], a1 - f[1], a2 - f[2]


@kernel(parallel=True)
def air_by_triangle(x, velocity, wind, faces, drag, lift, half_density, out: TriangleAir):
    """Computes the air on each triangle.

    Model: F = D (wind - v), D = rho/2 A (|u.n| (drag - lift |cos|) I + lift |u| n n^T), u = wind - v
    Reads: x (verts, 3) [m]; wind, velocity (verts, 3) [m/s]; faces (faces, 3); drag, lift (faces,); half_density = rho
        / 2 [kg/m^3].
    Writes: out.
    """
    force_out, matrix_out = out.force, out.matrix
    for f in prange(faces.shape[0]):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        u0 = (wind[i, 0] + wind[j, 0] + wind[k, 0] - velocity[i, 0] - velocity[j, 0] - velocity[k, 0]) / 3.0
        u1 = (wind[i, 1] + wind[j, 1] + wind[k, 1] - velocity[i, 1] - velocity[j, 1] - velocity[k, 1]) / 3.0
        u2 = (wind[i, 2] + wind[j, 2] + wind[k, 2] - velocity[i, 2] - velocity[j, 2] - velocity[k, 2]) / 3.0
        a0, a1, a2 = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]
        b0, b1, b2 = x[k, 0] - x[i, 0], x[k, 1] - x[i, 1], x[k, 2] - x[i, 2]
        n0, n1, n2 = a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0
        double = (n0 * n0 + n1 * n1 + n2 * n2) ** 0.5
        speed = (u0 * u0 + u1 * u1 + u2 * u2) ** 0.5
        if double < 1e-14 or speed < 1e-9:
            for c in range(3):
                force_out[f, c] = 0.0
            for c in range(6):
                matrix_out[f, c] = 0.0
            continue
        n0, n1, n2 = n0 / double, n1 / double, n2 / double
        across = abs(u0 * n0 + u1 * n1 + u2 * n2)
        scale = half_density * 0.5 * double / 3.0
        plain = scale * across * max(drag[f] - lift[f] * across / speed, 0.0)
        steep = scale * lift[f] * speed
        xx, xy, xz = plain + steep * n0 * n0, steep * n0 * n1, steep * n0 * n2
        yy, yz, zz = plain + steep * n1 * n1, steep * n1 * n2, plain + steep * n2 * n2
        matrix_out[f, 0], matrix_out[f, 1], matrix_out[f, 2] = xx, xy, xz
        matrix_out[f, 3], matrix_out[f, 4], matrix_out[f, 5] = yy, yz, zz
        force_out[f, 0] = xx * u0 + xy * u1 + xz * u2
        force_out[f, 1] = xy * u0 + yy * u1 + yz * u2
        force_out[f, 2] = xz * u0 + yz * u1 + zz * u2


@kernel(parallel=True)
def air_at_vertices(at: Rows, triangles: TriangleAir, velocity, over_h, force_out, matrix_out):
    """Sums the air over the triangles of each vertex, as a function of its displacement s: force - matrix s.

    Model: F(v) = F(v0) - D (v - v0), v = s / h, so force = F(v0) + D v0 and matrix = D / h
    Reads: at: corners of each vertex, 3 face + corner; triangles; velocity (verts, 3) [m/s]; over_h = 1 / h [1/s].
    Writes: force_out (verts, 3) [N]; matrix_out (verts, 6) [N/m].
    """
    (corner_starts, corners), (force, matrix) = at, triangles
    for i in prange(force_out.shape[0]):
        for c in range(3):
            force_out[i, c] = 0.0
        for c in range(6):
            matrix_out[i, c] = 0.0
        for entry in range(corner_starts[i], corner_starts[i + 1]):
            f = corners[entry] // 3
            for c in range(3):
                force_out[i, c] += force[f, c]
            for c in range(6):
                matrix_out[i, c] += matrix[f, c]
        m, v0, v1, v2 = matrix_out[i], velocity[i, 0], velocity[i, 1], velocity[i, 2]
        force_out[i, 0] += m[0] * v0 + m[1] * v1 + m[2] * v2
        force_out[i, 1] += m[1] * v0 + m[3] * v1 + m[4] * v2
        force_out[i, 2] += m[2] * v0 + m[4] * v1 + m[5] * v2
        for c in range(6):
            matrix_out[i, c] *= over_h


__all__ = ["Air", "TriangleAir", "air_at_vertices", "air_by_triangle", "air_terms"]
