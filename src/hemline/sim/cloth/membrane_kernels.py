"""Membrane of St. Venant-Kirchhoff triangles: strains, forces at the corners, blocks of the Hessian.

Source: Volino, Magnenat-Thalmann, Faure, "A simple approach to nonlinear tensile stiffness for accurate cloth
    simulation", 2009.
Differs: isotropic and linear in the strain; the Hessian leaves out compression beyond what inertia makes harmless.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from hemline.compiled import kernel, prange

from .rows import Rows

FAST = {"contract", "nsz", "arcp"}


class Fabric(NamedTuple):
    """Triangles of a sheet: rest metric and constants of the membrane, see `Sheet`."""

    faces: Int[np.ndarray, "faces 3"]
    shape: Float[np.ndarray, "faces 3 2"]
    area: Float[np.ndarray, " faces"]
    lame: Float[np.ndarray, " faces"]
    shear: Float[np.ndarray, " faces"]
    damping: Float[np.ndarray, " faces"]


class Stretch(NamedTuple):
    """State of the membrane in each triangle, computed by `membrane`.

    Attributes:
        corner: Gradient of the energy at the three corners [N].
        frame: Columns u and v of the deformation gradient.
        tension: Area times the stress S+ without compression beyond the cap, as uu, vv, uv [N m].
        energy: Energy [J].
    """

    corner: Float[np.ndarray, "faces 9"]
    frame: Float[np.ndarray, "faces 6"]
    tension: Float[np.ndarray, "faces 3"]
    energy: Float[np.ndarray, " faces"]


@kernel(parallel=True, fastmath=FAST)
def green_strain(vertices, faces, shape, strain_out):
    """Computes the Green strain of each triangle on its rest metric.

    Reads: vertices (verts, 3) [m]; faces (faces, 3); shape (faces, 3, 2) [1/m].
    Writes: strain_out (faces, 3): uu, vv, 2 uv.
    """
    for f in prange(faces.shape[0]):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        uu = vv = uv = 0.0
        for c in range(3):
            d1 = vertices[j, c] - vertices[i, c]
            d2 = vertices[k, c] - vertices[i, c]
            u = d1 * shape[f, 1, 0] + d2 * shape[f, 2, 0]
            v = d1 * shape[f, 1, 1] + d2 * shape[f, 2, 1]
            uu += u * u
            vv += v * v
            uv += u * v
        strain_out[f, 0] = 0.5 * (uu - 1.0)
        strain_out[f, 1] = 0.5 * (vv - 1.0)
        strain_out[f, 2] = uv


@kernel(parallel=True, fastmath=FAST)
def membrane(vertices, fabric: Fabric, strain_start, over_h, cap, out: Stretch):
    """Computes energy and forces of the membrane, and what its Hessian needs.

    Model: S = C : (E + v (E - E_start)), energy = area / 2 (E : C : E + v dE : C : dE), v = damping / h
    Reads: vertices (verts, 3) float64 [m]; fabric; strain_start (faces, 3); over_h = 1 / h [1/s]; cap (faces,) [N m].
    Writes: out.
    """
    faces, shape, area, lame, shear, damping = fabric
    corner_out, frame_out, tension_out, energy_out = out.corner, out.frame, out.tension, out.energy
    for f in prange(faces.shape[0]):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        g1u, g1v, g2u, g2v = shape[f, 1, 0], shape[f, 1, 1], shape[f, 2, 0], shape[f, 2, 1]
        uu = vv = uv = 0.0
        for c in range(3):
            d1 = vertices[j, c] - vertices[i, c]
            d2 = vertices[k, c] - vertices[i, c]
            u = d1 * g1u + d2 * g2u
            v = d1 * g1v + d2 * g2v
            frame_out[f, c] = u
            frame_out[f, 3 + c] = v
            uu += u * u
            vv += v * v
            uv += u * v
        euu, evv, euv = 0.5 * (uu - 1.0), 0.5 * (vv - 1.0), uv
        duu, dvv, duv = euu - strain_start[f, 0], evv - strain_start[f, 1], euv - strain_start[f, 2]
        viscous, c12, c33 = damping[f] * over_h, area[f] * lame[f], area[f] * shear[f]
        c11 = c12 + 2.0 * c33
        energy_out[f] = 0.5 * (
            c11 * (euu * euu + evv * evv)
            + 2.0 * c12 * euu * evv
            + c33 * euv * euv
            + viscous * (c11 * (duu * duu + dvv * dvv) + 2.0 * c12 * duu * dvv + c33 * duv * duv)
        )
        suu, svv, suv = euu + viscous * duu, evv + viscous * dvv, euv + viscous * duv
        suu, svv, suv = c11 * suu + c12 * svv, c11 * svv + c12 * suu, c33 * suv
        w1u, w1v = suu * g1u + suv * g1v, suv * g1u + svv * g1v
        w2u, w2v = suu * g2u + suv * g2v, suv * g2u + svv * g2v
        for c in range(3):
            one = frame_out[f, c] * w1u + frame_out[f, 3 + c] * w1v
            two = frame_out[f, c] * w2u + frame_out[f, 3 + c] * w2v
            corner_out[f, c] = -one - two
            corner_out[f, 3 + c] = one
            corner_out[f, 6 + c] = two
        middle, half = 0.5 * (suu + svv), 0.5 * (suu - svv)
        radius = (half * half + suv * suv) ** 0.5
        bound = -cap[f]
        if middle - radius < bound:
            high, low = max(middle + radius, bound), bound
            slope = 0.5 * (high - low) / radius if radius > 0.0 else 0.0
            mean = 0.5 * (high + low)
            suu, svv, suv = slope * (suu - middle) + mean, slope * (svv - middle) + mean, slope * suv
        tension_out[f, 0], tension_out[f, 1], tension_out[f, 2] = suu, svv, suv


@kernel(parallel=True, fastmath=FAST)
def membrane_blocks(corner_pairs: Rows, edge_slots, fabric: Fabric, stretch: Stretch, over_h, ring_bending, blocks_out):
    """Computes the off-diagonal blocks of the Hessian, (i, j) and its transpose (j, i), with the entries of bending.

    Model: K_ij = sum over shared triangles of sum_pq k_pq f_p f_q^T + (g_i . S+ g_j) I
    Reads: corner_pairs: of each edge, 9 face + 3 corner + corner; edge_slots (edges, 2): the two ring entries of each
        edge; stretch: from `membrane`; ring_bending (ring,): start values of the blocks [N/m].
    Writes: blocks_out: one block per ring entry, by columns, flat float32 [N/m].
    """
    edge_starts, edge_corners = corner_pairs
    _, shape, area, lame, shear, damping = fabric
    _, frame, tension, _ = stretch
    for e in prange(edge_slots.shape[0]):
        ij, ji = edge_slots[e, 0], edge_slots[e, 1]
        xx = yy = zz = ring_bending[ij]
        xy = xz = yx = yz = zx = zy = 0.0
        for entry in range(edge_starts[e], edge_starts[e + 1]):
            code = edge_corners[entry]
            f = code // 9
            i, j = code % 9 // 3, code % 3
            iu, iv, ju, jv = shape[f, i, 0], shape[f, i, 1], shape[f, j, 0], shape[f, j, 1]
            a = area[f] * (1.0 + damping[f] * over_h)
            c12, c33 = a * lame[f], a * shear[f]
            c11 = c12 + 2.0 * c33
            kuu = c11 * iu * ju + c33 * iv * jv
            kvv = c11 * iv * jv + c33 * iu * ju
            kuv = c12 * iu * jv + c33 * iv * ju
            kvu = c12 * iv * ju + c33 * iu * jv
            s = iu * (tension[f, 0] * ju + tension[f, 2] * jv) + iv * (tension[f, 2] * ju + tension[f, 1] * jv)
            u0, u1, u2 = frame[f, 0], frame[f, 1], frame[f, 2]
            v0, v1, v2 = frame[f, 3], frame[f, 4], frame[f, 5]
            # K = u (kuu u + kuv v)^T + v (kvu u + kvv v)^T
            a0, a1, a2 = kuu * u0 + kuv * v0, kuu * u1 + kuv * v1, kuu * u2 + kuv * v2
            b0, b1, b2 = kvu * u0 + kvv * v0, kvu * u1 + kvv * v1, kvu * u2 + kvv * v2
            xx += u0 * a0 + v0 * b0 + s
            xy += u0 * a1 + v0 * b1
            xz += u0 * a2 + v0 * b2
            yx += u1 * a0 + v1 * b0
            yy += u1 * a1 + v1 * b1 + s
            yz += u1 * a2 + v1 * b2
            zx += u2 * a0 + v2 * b0
            zy += u2 * a1 + v2 * b1
            zz += u2 * a2 + v2 * b2 + s
        b = blocks_out[9 * ij : 9 * ij + 9]
        b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7], b[8] = xx, yx, zx, xy, yy, zy, xz, yz, zz
        b = blocks_out[9 * ji : 9 * ji + 9]
        b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7], b[8] = xx, xy, xz, yx, yy, yz, zx, zy, zz


__all__ = ["FAST", "Fabric", "Stretch", "green_strain", "membrane", "membrane_blocks"]
