"""Half a kick of all velocities: tensions, then impulses, paper section 3, steps 1 and 4."""

import math

from hemline.compiled import kernel

from .tension_kernels import (
    impulse_demand,
    pull,
    rope_directions,
    rope_matrix,
    solve_direct,
    solve_sweeps,
    tension_demand,
)

TENSION_SWEEPS, IMPULSE_SWEEPS = 0, 1
NEARLY = 0.01
"""A rope may pull when its span is at least (1 - this) of its length, as much as it must to be taut a step later."""
SPEED_LIMIT = 200.0
"""No node moves faster relative to its chain's root [m/s]; far above anything that cloth does."""


@kernel
def read_geometry(offsets, lengths, inverse_masses, positions, directions_out, system_out, taut_out):
    # model: chains   in: positions (nodes, 3)   out: directions_out (nodes, 3), taut_out (nodes,),
    #     system_out (4, nodes): spans, slack, diagonal and side of the matrix
    for c in range(offsets.shape[0] - 1):
        a, b = offsets[c], offsets[c + 1]
        rope_directions(
            positions[a:b],
            lengths[a:b],
            NEARLY,
            directions_out[a:b],
            system_out[0, a:b],
            system_out[1, a:b],
            taut_out[a:b],
        )
        rope_matrix(directions_out[a:b], inverse_masses[a:b], system_out[2, a:b], system_out[3, a:b])


@kernel
def kick(
    offsets,
    inverse_masses,
    choices,
    h,
    accelerations,
    root_velocities,
    second,
    directions,
    system,
    taut,
    velocities_out,
    tensions_out,
    held_out,
    numbers_work,
    flags_work,
):
    # model: chains   in: external accelerations (nodes, 3); root_velocities (chains, 3) at the end of this half step;
    #     second: 1.0 for the half step that ends the step; the geometry
    # in/out: velocities_out (roots at its beginning), tensions_out (warm)   out: held_out (nodes,) ropes that pull
    # Steps 1 and 4: Eq. 2 to 5, then the impulses of Eq. 6 to 9.
    for c in range(offsets.shape[0] - 1):
        a, b = offsets[c], offsets[c + 1]
        count = b - a
        wanted, upper, active = numbers_work[0, :count], numbers_work[1, :count], flags_work[0, :count]
        free, v, tensions = flags_work[1, :count], velocities_out[a:b], tensions_out[a:b]
        for d in range(3):
            accelerations[a, d] = (root_velocities[c, d] - v[0, d]) * 2.0 / h
        for i in range(count):
            free[i] = False
        # how fast the ropes turn half a step later depends on the tensions: first without, then with that
        for attempt in range(2):
            tension_demand(
                directions[a:b],
                system[0, a:b],
                system[1, a:b],
                inverse_masses[a:b],
                tensions,
                v,
                accelerations[a:b],
                h,
                0.5 * h * attempt,
                wanted,
            )
            if choices[TENSION_SWEEPS] > 0:
                solve_sweeps(
                    system[2, a:b], system[3, a:b], wanted, taut[a:b], free, choices[TENSION_SWEEPS], 1.0, tensions
                )
            else:
                solve_direct(system[2, a:b], system[3, a:b], wanted, taut[a:b], free, tensions, active, upper)
        for i in range(count):
            held_out[a + i] = i > 0 and tensions[i] > 0.0
            free[i] = second > 0.0 and held_out[a + i]
            for d in range(3):
                v[i, d] += 0.5 * h * accelerations[a + i, d]
        pull(directions[a:b], inverse_masses[a:b], tensions, 0.5 * h, v)
        apply_impulses(
            directions[a:b],
            inverse_masses[a:b],
            system[1:, a:b],
            taut[a:b],
            free,
            choices,
            h,
            v,
            numbers_work,
            active,
        )


@kernel
def apply_impulses(
    directions, inverse_masses, system, taut, held, choices, h, velocities_out, numbers_work, active_work
):
    # in: one chain, system (3, m + 1): its slack and matrix, substep h
    # in/out: velocities_out: no rope lengthens beyond its length after it, no held one shortens
    slack, diagonal, beside = system[0], system[1], system[2]
    count = diagonal.shape[0]
    wanted, upper, impulses = numbers_work[0, :count], numbers_work[1, :count], numbers_work[2, :count]
    impulse_demand(directions, slack, velocities_out, h, wanted)
    for i in range(impulses.shape[0]):
        impulses[i] = 0.0
    if choices[IMPULSE_SWEEPS] > 0:
        solve_sweeps(diagonal, beside, wanted, taut, held, choices[IMPULSE_SWEEPS], 0.0, impulses)
    else:
        solve_direct(diagonal, beside, wanted, taut, held, impulses, active_work, upper)
    pull(directions, inverse_masses, impulses, 1.0, velocities_out)


@kernel
def limit_speeds(offsets, velocities_out):
    for c in range(offsets.shape[0] - 1):
        r = offsets[c]
        for i in range(r + 1, offsets[c + 1]):
            x, y, z = (
                velocities_out[i, 0] - velocities_out[r, 0],
                velocities_out[i, 1] - velocities_out[r, 1],
                velocities_out[i, 2] - velocities_out[r, 2],
            )
            speed = math.sqrt(x * x + y * y + z * z)
            if speed > SPEED_LIMIT:
                share = SPEED_LIMIT / speed
                velocities_out[i, 0] = velocities_out[r, 0] + share * x
                velocities_out[i, 1] = velocities_out[r, 1] + share * y
                velocities_out[i, 2] = velocities_out[r, 2] + share * z
