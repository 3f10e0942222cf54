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


@kernel
def add_air(sheet, wind, half_density, positions, velocities, accelerations):
    """Adds drag and lift of the air, as `sim.cloth.air_kernels` computes them.

    Reads: sheet: a `SpringSheet`; wind (verts, 3) [m/s]; half_density [kg/m^3]; positions (verts, 3) [m]; velocities
        (verts, 3) [m/s].
    Writes: accelerations (verts, 3) [m/s^2].
    """
    faces, inverse, third, half = sheet.faces, sheet.inverse_masses, np.float32(1 / 3), np.float32(0.5)
    zero = np.float32(0)
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
        steep = scale * sheet.lift[f] * speed * along
        fx, fy, fz = plain * ux + steep * nx, plain * uy + steep * ny, plain * uz + steep * nz
        for v in (i, j, k):
            accelerations[v, 0] += inverse[v] * fx
            accelerations[v, 1] += inverse[v] * fy
            accelerations[v, 2] += inverse[v] * fz


@kernel
def add_bending(sheet, seconds, positions, accelerations):
    """Adds the bending forces, damped as if each vertex moved alone, so that a stiff fabric stays stable.

    Model: a_i = -(Q x)_i / (m_i + h^2 Q_ii)
    Reads: sheet: a `SpringSheet`; seconds: h, the time for which the forces are kept [s]; positions (verts, 3) [m].
    Writes: accelerations (verts, 3) [m/s^2].
    """
    start, columns, values, inverse = sheet.row_start, sheet.columns, sheet.bending, sheet.inverse_masses
    one = np.float32(1)
    for number in range(len(positions)):
        i = _index(number)
        x, y, z = positions[i, 0], positions[i, 1], positions[i, 2]
        fx, fy, fz = np.float32(0), np.float32(0), np.float32(0)
        for entry in range(start[i], start[i + _index(1)]):
            e = _index(entry)
            j, q = _index(columns[e]), values[e]
            fx, fy, fz = fx + q * (x - positions[j, 0]), fy + q * (y - positions[j, 1]), fz + q * (z - positions[j, 2])
        w = inverse[i] / (one + seconds * seconds * sheet.bending_diagonal[i] * inverse[i])
        accelerations[i, 0] += w * fx
        accelerations[i, 1] += w * fy
        accelerations[i, 2] += w * fz


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
    add_air(sheet, wind, surroundings.half_density, positions, velocities, accelerations_out)
    add_bending(sheet, seconds, positions, accelerations_out)
    add_viscosity(sheet, surroundings.viscosity, velocities, accelerations_out)
