"""Compiled: accelerations of point masses by gravity, air and bending."""

from typing import NamedTuple

import numpy as np

from hemline.compiled import kernel

_index = np.uintp


class Surroundings(NamedTuple):
    """What acts on the cloth from outside, apart from the body."""

    gravity: tuple[np.float32, np.float32, np.float32]
    """Gravity [m/s^2]."""
    half_density: np.float32
    """Half the density of the air [kg/m^3]."""
    viscosity: np.float32
    """Rate at which the velocities of the ends of an edge become alike [1/s]."""


@kernel(forceinline=True)
def add_force(give, i, x, y, z, accelerations):
    """Adds a force on a vertex.

    Reads: give (verts,): acceleration for each newton [1/kg]; i: the vertex; x, y, z: the force [N].
    Writes: accelerations (verts, 3) [m/s^2].
    """
    accelerations[i, 0] += give[i] * x
    accelerations[i, 1] += give[i] * y
    accelerations[i, 2] += give[i] * z


@kernel
def add_air(sheet, wind, half_density, seconds, positions, velocities, accelerations):
    """Adds drag and lift of the air, as `sim.cloth.air_kernels` computes them, but so that no storm blows a vertex
    faster than itself, however long the forces are kept.

    Model: a_i = F_i / max(m_i, 6 h |D|), with F = D (wind - v) on each of about six triangles
    Reads: sheet: a `SpringSheet`; wind (verts, 3) [m/s]; half_density [kg/m^3]; seconds: h, the time for which the
        forces are kept [s]; positions (verts, 3) [m]; velocities (verts, 3) [m/s].
    Writes: accelerations (verts, 3) [m/s^2].
    """
    faces, inverse, third, half = sheet.faces, sheet.inverse_masses, np.float32(1 / 3), np.float32(0.5)
    zero, one = np.float32(0), np.float32(1)
    for number in range(len(faces)):
        f = _index(number)
        i, j, k = _index(faces[f, 0]), _index(faces[f, 1]), _index(faces[f, 2])
        ux = (wind[i, 0] + wind[j, 0] + wind[k, 0] - velocities[i, 0] - velocities[j, 0] - velocities[k, 0]) * third
        uy = (wind[i, 1] + wind[j, 1] + wind[k, 1] - velocities[i, 1] - velocities[j, 1] - velocities[k, 1]) * third
        uz = (wind[i, 2] + wind[j, 2] + wind[k, 2] - velocities[i, 2] - velocities[j, 2] - velocities[k, 2]) * third
        x, y, z = positions[i, 0], positions[i, 1], positions[i, 2]
        ax, ay, az = positions[j, 0] - x, positions[j, 1] - y, positions[j, 2] - z
        bx, by, bz = positions[k, 0] - x, positions[k, 1] - y, positions[k, 2] - z
        nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        double = np.sqrt(nx * nx + ny * ny + nz * nz)
        speed = np.sqrt(ux * ux + uy * uy + uz * uz)
        if double < np.float32(1e-12) or speed < np.float32(1e-6):
            continue
        nx, ny, nz = nx / double, ny / double, nz / double
        along = ux * nx + uy * ny + uz * nz
        across, scale = abs(along), half_density * half * double * third
        plain = scale * across * max(sheet.drag[f] - sheet.lift[f] * across / speed, zero)
        steep = scale * sheet.lift[f] * speed
        damping, normal = np.float32(6) * seconds * (plain + steep), steep * along
        fx, fy, fz = plain * ux + normal * nx, plain * uy + normal * ny, plain * uz + normal * nz
        for v in (i, j, k):
            share = one / max(one, damping * inverse[v])
            add_force(inverse, v, share * fx, share * fy, share * fz, accelerations)


@kernel
def add_bending(sheet, give, positions, accelerations):
    """Adds the forces of bending about each inner edge, as `sim.cloth.hinge_kernels` computes them.

    Reads: sheet: a `SpringSheet`; give (verts,): acceleration for each newton [1/kg]; positions (verts, 3) [m].
    Writes: accelerations (verts, 3) [m/s^2].
    """
    hinges, zero, one, two, tiny = sheet.hinges, np.float32(0), np.float32(1), np.float32(2), np.float32(1e-20)
    half_one = np.float32(0.5)
    for number in range(len(hinges)):
        h = _index(number)
        i, j, k, l = _index(hinges[h, 0]), _index(hinges[h, 1]), _index(hinges[h, 2]), _index(hinges[h, 3])
        x, y, z = positions[i, 0], positions[i, 1], positions[i, 2]
        ex, ey, ez = positions[j, 0] - x, positions[j, 1] - y, positions[j, 2] - z
        ax, ay, az = positions[k, 0] - x, positions[k, 1] - y, positions[k, 2] - z
        bx, by, bz = positions[l, 0] - x, positions[l, 1] - y, positions[l, 2] - z
        mx, my, mz = ey * az - ez * ay, ez * ax - ex * az, ex * ay - ey * ax
        nx, ny, nz = by * ez - bz * ey, bz * ex - bx * ez, bx * ey - by * ex
        ee, mm, nn = ex * ex + ey * ey + ez * ez, mx * mx + my * my + mz * mz, nx * nx + ny * ny + nz * nz
        if min(mm, nn) < tiny:
            continue
        length, both = np.sqrt(ee), np.sqrt(mm * nn)
        cosine = min(max((mx * nx + my * ny + mz * nz) / both, -one), one)
        sine = (my * nz - mz * ny) * ex + (mz * nx - mx * nz) * ey + (mx * ny - my * nx) * ez
        bent, half = np.sqrt(two * (one - cosine)), np.sqrt(half_one * (one + cosine))
        scale = sheet.hinge_weights[h] * ((-bent if sine < zero else bent) - sheet.hinge_rests[h]) * half * length
        at_k, at_l = scale / mm, scale / nn
        part_k, part_l = (ax * ex + ay * ey + az * ez) / ee, (bx * ex + by * ey + bz * ez) / ee
        kx, ky, kz, lx, ly, lz = at_k * mx, at_k * my, at_k * mz, at_l * nx, at_l * ny, at_l * nz
        rest_k, rest_l = one - part_k, one - part_l
        add_force(give, k, kx, ky, kz, accelerations)
        add_force(give, l, lx, ly, lz, accelerations)
        add_force(
            give,
            i,
            -rest_k * kx - rest_l * lx,
            -rest_k * ky - rest_l * ly,
            -rest_k * kz - rest_l * lz,
            accelerations,
        )
        add_force(
            give,
            j,
            -part_k * kx - part_l * lx,
            -part_k * ky - part_l * ly,
            -part_k * kz - part_l * lz,
            accelerations,
        )


@kernel
def bending_give(sheet, seconds):
    """Computes how far a force of bending accelerates each vertex, as if the vertex moved alone in an implicit step.

    A fabric that is too stiff for the step so stays stable.

    Model: 1 / (m_i + h^2 Q_ii)
    Reads: sheet: a `SpringSheet`; seconds: h, the time for which the forces are kept [s].
    Returns: Acceleration for each newton (verts,) [1/kg], float32.
    """
    inverse, give = sheet.inverse_masses, np.empty_like(sheet.inverse_masses)
    for number in range(len(inverse)):
        i = _index(number)
        give[i] = inverse[i] / (np.float32(1) + seconds * seconds * sheet.bending_stiffness[i] * inverse[i])
    return give


@kernel
def add_viscosity(sheet, viscosity, velocities, accelerations):
    """Adds forces that even out the velocities of the ends of each edge.

    Model: a_a += c w_a / max(w_a, w_b) (v_b - v_a)
    Reads: sheet: a `SpringSheet`; viscosity: c [1/s]; velocities (verts, 3) [m/s].
    Writes: accelerations (verts, 3) [m/s^2].
    """
    edges, inverse = sheet.edges, sheet.inverse_masses
    for number in range(len(edges)):
        e = _index(number)
        a, b = _index(edges[e, 0]), _index(edges[e, 1])
        scale = viscosity / max(inverse[a], inverse[b])
        for_a, for_b = scale * inverse[a], scale * inverse[b]
        for axis in range(3):
            apart = velocities[b, axis] - velocities[a, axis]
            accelerations[a, axis] += for_a * apart
            accelerations[b, axis] -= for_b * apart


@kernel
def accelerate(sheet, surroundings, wind, seconds, positions, velocities, accelerations_out):
    """Computes the acceleration of each vertex by gravity, air, bending and viscosity.

    Reads: sheet: a `SpringSheet`; surroundings; wind (verts, 3) [m/s]; seconds: time for which the accelerations are
        kept [s]; positions (verts, 3) [m]; velocities (verts, 3) [m/s].
    Writes: accelerations_out (verts, 3) [m/s^2].
    """
    gravity = surroundings.gravity
    for i in range(len(positions)):
        accelerations_out[i, 0], accelerations_out[i, 1], accelerations_out[i, 2] = gravity[0], gravity[1], gravity[2]
    add_air(sheet, wind, surroundings.half_density, seconds, positions, velocities, accelerations_out)
    add_bending(sheet, bending_give(sheet, seconds), positions, accelerations_out)
    add_viscosity(sheet, surroundings.viscosity, velocities, accelerations_out)
